# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Decides what a road that does not slide means: the vehicle stands, or its view is covered."""

from dataclasses import replace
import math

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
        self.forget()

    def forget(self) -> None:
        """Restart with the next pair."""
        self.lasts = False
        """Whether the road has rested for long enough to show that the vehicle stands."""
        self.covered = False
        """Whether something covers the view of a vehicle that drives."""
        # Whether the road rested in the newest pair that was compared, and whether it may have
        # since the vehicle stood, or was first seen.
        self._stops, self._stays = False, True
        # Time since most blocks did not agree, in seconds.
        self._agreed_s = math.inf

    def predict(self, interval: float, *, certain: bool) -> None:
        """Add a pair of ``interval`` seconds, in which the motion of the camera is ``certain``."""
        self._agreed_s = self._agreed_s + interval if certain else 0.0

    def rests(self, near: PatchMatcher, key: RoadKeyframe, *, passes: bool) -> bool:
        """
        Return whether the road rests in the near patch, so that the vehicle may stand.

        ``passes`` is whether the world passes by in the newest pair, as the blocks show.
        """
        speeds = self._speeds
        self._stays |= speeds.standing
        # What recedes may be traffic that drives off, and so may be what moves as a vehicle stops,
        # unless all creeps: then an encoder may have copied the road of a slow vehicle.
        stops = speeds.standing or (
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
        # Only small robots brake so hard. Where the blocks did not agree before, they have changed
        # over from the scene to what covers it.
        self.covered |= self._speeds.least > 0.0 and self._agreed_s < TUNING.covering_time
        if self.covered:
            return replace(self._speeds.bridge(interval, measured), covered=True)
        return replace(self._speeds.stand(interval), rests=rests)
