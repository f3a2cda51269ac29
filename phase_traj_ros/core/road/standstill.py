# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Decides what a road that does not slide means: the vehicle stands, or its view is covered."""

from collections import deque
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.road.keyframe import RoadKeyframe
from phase_traj_ros.core.road.patch_matcher import PatchMatcher
from phase_traj_ros.core.road.speed_filter import SpeedFilter
from phase_traj_ros.core.road.travel import Travel
from phase_traj_ros.core.road.tuning import TUNING


class Standstill:
    """Remembers for how long the road has rested, and how the view was before."""

    def __init__(self, speeds: SpeedFilter) -> None:
        """Start before the first pair; ``speeds`` is the filter of the speed, which it stops."""
        self._speeds = speeds
        self.lasts = False
        """Whether the road has rested for long enough to show that the vehicle stands."""
        self.covered = False
        """Whether something covers the view of a vehicle that drives."""
        # Whether the road rested in the newest pair that was compared, and whether it may have
        # since the vehicle stood, or was first seen.
        self._stops, self._stays = False, True
        # Thumbnails of the newest frames, the oldest first, with their times and headings.
        self._seen: deque[tuple[float, float, NDArray[np.float32]]] = deque()
        self._time = self._heading = 0.0

    def see(self, frame: Frame, interval: float, yaw: float) -> None:
        """Add a frame, (H, W), which is ``interval`` seconds and ``yaw`` rad after the last."""
        step = max(min(frame.shape) // TUNING.thinned_px, 1)
        thumbnail = cv2.resize(
            np.asarray(frame[::step, ::step], np.float32), TUNING.thumbnail_px,
            interpolation=cv2.INTER_AREA)
        self._time += interval
        self._heading += yaw
        self._seen.append((self._time, self._heading, thumbnail))  # type: ignore[arg-type]
        while (self._time - self._seen[0][0] > TUNING.recall_time
               or abs(self._heading - self._seen[0][1]) > TUNING.recall_yaw):
            self._seen.popleft()

    def rests(
        self, near: PatchMatcher, key: RoadKeyframe, *, still: bool, passes: bool,
    ) -> bool:
        """
        Return whether the road rests in the near patch, so that the vehicle may stand.

        ``still`` is whether nothing moves in the picture of the newest pair; ``passes`` is whether
        the world passes by, as the blocks show.
        """
        speeds = self._speeds
        self._stays |= speeds.standing
        # What recedes may be traffic that drives off, and so may be what moves as a vehicle stops,
        # unless all creeps: then an encoder may have copied the road of a slow vehicle.
        stops = still or speeds.standing or (
            (speeds.may_stand or self._stops) and not (passes or key.creeps))
        rests = ((stops and near.has_moved) or (key.recedes and self._stays)) and near.rests()
        if rests and passes and not self.lasts:
            # The patch shows the vehicle or its load, unless this is an error of a single pair.
            speeds.forget()
        self._stops = rests and not passes
        self._stays &= rests or not key.recedes
        self.lasts &= self._stops
        return rests

    def halt(self, interval: float, measured: Travel, *, rests: bool = False) -> Travel:
        """
        Return the distance of a pair in which nothing moves.

        ``measured`` is the newest measured distance; for ``rests``, see ``Travel``.
        """
        # Only small robots brake so hard, and they still see the same scene then.
        self.covered |= self._speeds.least > 0.0 and not self._sees_the_same
        if self.covered:
            return replace(self._speeds.bridge(interval, measured), covered=True)
        return replace(self._speeds.stand(interval), rests=rests)

    @property
    def _sees_the_same(self) -> bool:
        """Return whether the newest frame shows the scene of before, if that had looked alike."""
        first, later, newest = (self._seen[at][2] for at in (0, len(self._seen) // 4, -1))
        return _alike(first, newest) or not _alike(first, later)


def _alike(first: NDArray[np.float32], second: NDArray[np.float32]) -> bool:
    correlation = cv2.matchTemplate(second, first, cv2.TM_CCOEFF_NORMED)
    return float(correlation.item()) > TUNING.same_scene
