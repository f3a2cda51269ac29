# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Converts the distance on the road to the unit of the path; a given speed replaces it."""

from dataclasses import replace
import math

from phase_traj_ros.core.camera.camera_height import CameraHeight
from phase_traj_ros.core.camera.lens import Lens, LensOrigin
from phase_traj_ros.core.camera.tuning import TUNING as CAMERA
from phase_traj_ros.core.path.speed import SpeedTrack
from phase_traj_ros.core.road.travel import Travel, TravelState
from phase_traj_ros.core.road.tuning import TUNING
from phase_traj_ros.core.settings import EstimatorSettings
from phase_traj_ros.core.status import PairStatus


class DistanceMeter:
    """Gives the distance of each pair in the unit of the path (see ``Travel``)."""

    def __init__(self, settings: EstimatorSettings) -> None:
        """Make a meter before the first frame."""
        self._settings = settings
        self.speeds = SpeedTrack(max_speeds=settings.max_speeds)
        """Given speeds of the vehicle."""
        self._height = CameraHeight(settings.camera_height, settings.camera_height_deviation)
        self.heights_per_second: float | None = None
        """Newest speed in camera heights per second, negative in reverse; None if unknown."""
        # Stamp since which the road slides the other way than by the given speed.
        self._against_ns: int | None = None

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Continue with other settings; speeds and height are kept."""
        self._settings = settings

    def change_lens(self, before: Lens, lens: Lens, width: int) -> None:
        """Continue with another lens than ``before``, in frames ``width`` pixels wide."""
        if before.is_guess:
            self._height.change_lens(
                lens.focal_ratio(before, width), lens.straightness - before.straightness,
                assumed=before.origin is LensOrigin.ASSUMED)

    def reset(self) -> None:
        """Forget the newest speed; the height of the camera is kept."""
        self.heights_per_second = None
        self._against_ns = None

    def update(
        self, on_road: Travel | None, status: PairStatus, stamp_ns: int, interval_ns: int,
    ) -> Travel | None:
        """
        Return the distance of the next pair; None if it has none.

        ``on_road`` is the distance on the road in camera heights, None if it is not measured;
        ``interval_ns`` the time since the previous frame.
        """
        if not self._settings.measures_distance:
            return None
        interval = interval_ns * 1e-9
        if on_road is not None and not on_road.known and not status.judged:
            on_road = replace(on_road, distance=0.0)
        self.heights_per_second = (
            on_road.distance / interval if on_road is not None and on_road.known else None)
        if not self._settings.metric:
            return on_road
        given = self._given_distance(status, stamp_ns, interval_ns)
        if given is not None:
            return self._by_speed(given, on_road, stamp_ns, interval)
        metres = self._height.metres
        if on_road is None or metres is None or not on_road.known:
            deviation = TUNING.unknown_speed_deviation * CAMERA.usual_height * interval
            return Travel(
                0.0, deviation ** 2, TravelState.UNKNOWN,
                rivalled=on_road is not None and on_road.rivalled)
        return on_road.scaled(metres, self._height.deviation)

    def _given_distance(self, status: PairStatus, stamp_ns: int, interval_ns: int) -> float | None:
        """Return the distance in metres by a given speed; None without a speed."""
        if self._settings.awaits_speeds:
            return self.speeds.distance(stamp_ns - interval_ns, stamp_ns)
        if self._settings.speed == 0.0:
            return None
        return 0.0 if status is PairStatus.STILL else self._settings.speed * interval_ns * 1e-9

    def _by_speed(
        self, given: float, on_road: Travel | None, stamp_ns: int, interval: float,
    ) -> Travel:
        """Return the distance in metres by a given speed, which tells the height of the camera."""
        height = self._height.metres or CAMERA.usual_height
        self.heights_per_second = given / (interval * height)
        if (given > 0.0 and on_road is not None and on_road.state is TravelState.MEASURED
                and on_road.distance > TUNING.min_calibration_speed * interval):
            self._height.add(given, on_road.distance, interval)
        return Travel(
            given, (TUNING.given_speed_error * given) ** 2, TravelState.GIVEN,
            scale=TUNING.given_speed_error,
            rivalled=on_road is not None and on_road.measured and self._contradicts(
                on_road.distance / interval, self.heights_per_second, stamp_ns))

    def _contradicts(self, seen: float, given: float, stamp_ns: int) -> bool:
        """Return whether the road has long slid the other way than by a given speed (heights)."""
        # It does if the speed has no sign, and if a leader that drives off hides the road.
        if (abs(given) < TUNING.against_speed
                or seen * math.copysign(1.0, given) > -TUNING.against_share * abs(given)):
            self._against_ns = None
        elif self._against_ns is None:
            self._against_ns = stamp_ns
        return (self._against_ns is not None
                and stamp_ns - self._against_ns > TUNING.speed_delay_ns)
