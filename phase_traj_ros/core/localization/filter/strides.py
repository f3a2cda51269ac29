# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Dead reckoning of the odometry in strides of equal length, the steps of the filter."""

import cmath
from dataclasses import dataclass
import math

import numpy as np
from phase_traj_ros.core.localization.given import OdometryStep
from phase_traj_ros.core.localization.roads import Complexes, Floats
from phase_traj_ros.core.localization.settings import LocatorSettings


@dataclass(frozen=True, slots=True, kw_only=True)
class Stride:
    """
    A stride of the odometry and the chord that ends with it, in the axes of the odometry.

    distance
        Distance along the path, in the unit of the odometry: forward minus reverse.
    in_reverse
        How far the vehicle went back from its farthest point during the stride, 0 or more.
    displacement
        From the start to the end of the stride.
    distance_variance, yaw_variance
        Variances of the distance and of the change of the heading during the stride.
    scale_variance
        Variance of the change of the logarithm of the scale during the stride.
    chord
        Direction from the start to the end of the last strides, in radians.
    bend
        Sum of the absolute changes of direction between these strides, in radians.
    turned
        Change of the chord since the previous stride, in radians.
    repeated
        Whether the vehicle has driven here before, in the same direction.
    """

    distance: float
    in_reverse: float
    displacement: complex
    distance_variance: float
    yaw_variance: float
    scale_variance: float
    chord: float
    bend: float
    turned: float
    repeated: bool


class DeadReckoning:
    """Integrates steps of the odometry, and sums them to strides."""

    def __init__(self, settings: LocatorSettings, unit_m: float) -> None:
        """Start at the origin, with heading 0; the unit of the odometry is ``unit_m`` metres."""
        self.stride = settings.stride_m / unit_m
        """Length of a stride in the unit of the odometry."""
        self._strides = settings.chord_strides
        self.heading = 0.0
        """Heading in radians since the start, not wrapped."""
        self.position = 0j
        """Position at the end of the last stride, in the axes and the unit of the odometry."""
        self.since = 0j
        """Displacement since the last stride."""
        self._laps = _LapDetector(settings, unit_m)
        self._way = 0.0
        # The position up to which the way is summed.
        self._summed = 0j
        self.trail: Complexes
        """Ends of the last strides relative to the newest one, oldest first, (strides + 1,)."""
        self.restart()

    @property
    def way(self) -> float:
        """Return the length of the path, forward and reverse, in the unit of the odometry."""
        return self._way + abs(self.position + self.since - self._summed)

    def restart(self) -> None:
        """Replace the trail by a straight line, and begin a new stride at the current pose."""
        self.position += self.since
        along = np.complex128(cmath.rect(self.stride, self.heading))
        self.trail = along * np.arange(-self._strides, 1)
        self._chord = self.heading
        self._begin_stride()

    def _begin_stride(self) -> None:
        self.since = 0j
        self._distance = self._farthest = self._in_reverse = self._distance_variance = 0.0
        self._yaw_variance = self._scale_variance = 0.0

    def add(self, step: OdometryStep) -> Stride | None:
        """Integrate the next step; return the stride that it completes, None if it does not."""
        self.since += cmath.rect(step.distance, self.heading + step.yaw / 2)
        self.heading += step.yaw
        # In parts of a metre: the noise of a standing vehicle is not a way.
        if abs(self.position + self.since - self._summed) >= self.stride / 5:
            self._way, self._summed = self.way, self.position + self.since
        self._distance += step.distance
        # The sum of the negative steps would grow with the noise of a standing vehicle.
        self._farthest = max(self._farthest, self._distance)
        self._in_reverse = max(self._in_reverse, self._farthest - self._distance)
        self._distance_variance += step.distance_variance
        self._yaw_variance += step.yaw_variance
        self._scale_variance += step.scale_variance
        if self._distance < self.stride:
            return None
        self.position += self.since
        self.trail = np.append(self.trail[1:], self.since) - self.since
        across = complex(-self.trail[0])
        # The chord has no direction if the vehicle has returned to its start.
        chord = cmath.phase(across) if across else self._chord
        turned = math.remainder(chord - self._chord, math.tau)
        self._chord = chord
        stride = Stride(
            distance=self._distance, in_reverse=self._in_reverse, displacement=self.since,
            distance_variance=self._distance_variance, yaw_variance=self._yaw_variance,
            scale_variance=self._scale_variance, chord=chord, bend=float(bend_of(self.trail)),
            turned=turned, repeated=self._laps.add(self.position, self.heading, self._way))
        self._begin_stride()
        return stride


class _LapDetector:
    """Detects another lap: compares each pose with the earlier ones of the longest lap."""

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


def bend_of(trail: Complexes) -> Floats:
    """
    Return the sum of the absolute changes of direction along trails, in radians, (...).

    ``trail`` has the positions along its first axis, (strides + 1, ...).
    """
    parts = np.diff(trail, axis=0)
    bend: Floats = np.abs(np.angle(parts[1:] * parts[:-1].conj())).sum(axis=0)
    return bend
