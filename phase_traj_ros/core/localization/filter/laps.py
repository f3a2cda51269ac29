# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Detects that a vehicle drives another lap."""

import math

import numpy as np
from phase_traj_ros.core.localization.roads import Complexes, Floats
from phase_traj_ros.core.localization.settings import LocatorSettings


class LapDetector:
    """Compares each pose of the odometry with the earlier ones of the longest lap."""

    def __init__(self, settings: LocatorSettings, unit_m: float) -> None:
        """Start without poses; the unit of the odometry is ``unit_m`` metres."""
        count = round(settings.longest_lap_m / settings.stride_m)
        # Where the vehicle was, with which heading, and the way until then.
        self._positions: Complexes = np.full(count, np.nan, np.complex128)
        self._headings: Floats = np.zeros(count)
        self._ways: Floats = np.zeros(count)
        self._apart, self._least = settings.lap_apart_m / unit_m, settings.shortest_lap_m / unit_m
        self._alike = math.cos(settings.lap_heading)

    def add(self, position: complex, heading: float, way: float) -> bool:
        """
        Add the pose at the end of a stride; return whether the vehicle was here before.

        ``heading`` is in radians, ``way`` the length of the path so far.
        """
        near = np.abs(self._positions - position) < self._apart
        alike = np.cos(self._headings - heading) > self._alike
        repeated = bool((near & alike & (way - self._ways >= self._least)).any())
        self._positions = np.append(self._positions[1:], position)
        self._headings = np.append(self._headings[1:], heading)
        self._ways = np.append(self._ways[1:], way)
        return repeated
