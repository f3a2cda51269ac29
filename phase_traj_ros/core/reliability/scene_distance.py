# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Compares the speed of the road with the rate at which the scene passes.

Their ratio is the distance of what is near. It changes with the scene, but the road does not slow
down alone. Where it seems to, another motion was taken for that of the road, such as the ghost of
the previous frame in a picture that is averaged over time.
"""

import math

from phase_traj_ros.core.reliability.tuning import TUNING
from phase_traj_ros.core.road.travel import Travel, TravelState
from phase_traj_ros.core.road.tuning import TUNING as ROAD
from phase_traj_ros.core.rotation.camera_motion import running_mean


class SceneDistance:
    """Tells whether the road has slowed down, and the scene has not."""

    def __init__(self) -> None:
        """Start without a pair."""
        # Mean logarithms of the distance of the scene and of the speed: the newest and usual ones.
        self._newest: tuple[float, float] | None = None
        self._usual = (0.0, 0.0)
        # Seconds of the usual pairs, and since the newest of them.
        self._usual_s = self._unconfirmed_s = 0.0

    def contradicts(self, travel: Travel, near: float, interval: float) -> bool:
        """
        Add a pair, and return whether the newest pairs contradict the usual ones.

        ``near`` is that of its ``CameraMotion``, ``interval`` its time in seconds.
        """
        self._unconfirmed_s += interval
        if self._unconfirmed_s > TUNING.usual_scene_s:
            self._newest, self._usual_s = None, 0.0
        if near <= ROAD.passing or not travel.by_road:
            return False
        speed = max(travel.distance / interval, TUNING.min_scene_speed)
        pair = math.log(speed * interval / near), math.log(speed)
        self._newest = _mean(self._newest or pair, pair, interval, TUNING.scene_s)
        nearer, slower = (usual - newest for usual, newest in zip(self._usual, self._newest))
        if (self._usual_s > TUNING.min_usual_scene_s and nearer > math.log(TUNING.scene_nearer)
                and slower > math.log(TUNING.scene_slower)):
            return True
        if travel.state is TravelState.MEASURED:
            self._unconfirmed_s = 0.0
            self._usual_s += interval
            self._usual = _mean(
                self._usual if self._usual_s > interval else pair, pair, interval,
                min(self._usual_s, TUNING.usual_scene_s))
        return False


def _mean(
    mean: tuple[float, float], pair: tuple[float, float], interval: float, time: float,
) -> tuple[float, float]:
    first, second = (
        running_mean(old, new, interval, time=time) for old, new in zip(mean, pair))
    return first, second
