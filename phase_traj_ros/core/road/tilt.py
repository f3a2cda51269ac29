# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The pitch of the camera against the road, as it is now.

It is that of the mounting, which changes with the load at most, and what the springs add while
the vehicle brakes, speeds up or bounces. Two things tell their sum. A vehicle goes along the
road, so the camera looks down by as much as the direction of travel lies above its axis. And with
a pitch that is wrong by e, a place z heights ahead is taken to be (1 + z**2) e too far, so what
slides by s there seems to slide by s (1 + 2 z e): with the right pitch, near and far road agree.
"""

import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.horizon import Horizon

# What the springs do: standard deviation in radians, and for how long, in seconds.
_SPRINGS, _SWING = math.radians(0.4), 1.0
# The mounting changes by this within so many seconds: passengers, load, the slope of a hill.
_LOAD, _LOADING = math.radians(0.3), 600.0
# Neither the one nor the other evidence is better than this, however often it comes: a road is
# no plane, and a camera's middle not quite where it is taken to be.
_COMMON = 0.0015
# Farther off than so many deviations, a value counts ever less.
_FAR = 2.0


class RoadTilt:
    """Follows the pitch by a Kalman filter of two numbers: the mounting's and the springs'."""

    def __init__(self, horizon: Horizon, *, fixed: bool = False) -> None:
        """Start at what is known; a ``fixed`` mounting is believed as it is."""
        self._state = np.array([horizon.pitch, 0.0])
        mounting = 0.0 if fixed else horizon.pitch_deviation
        self._covariance = np.diag([mounting ** 2, _SPRINGS ** 2])
        self._fixed = fixed

    @property
    def mounting(self) -> float:
        """Return the pitch of the mounting in radians, nose down positive."""
        return float(self._state[0])

    @property
    def pitch(self) -> float:
        """Return the pitch now."""
        return float(self._state.sum())

    @property
    def deviation(self) -> float:
        """Return the standard deviation of the pitch now."""
        return math.sqrt(max(float(self._covariance.sum()), 0.0))

    @property
    def swing_deviation(self) -> float:
        """Return that of the part of it that changes within a second or so."""
        return math.sqrt(max(float(self._covariance[1, 1]), 0.0))

    @property
    def common_deviation(self) -> float:
        """Return that of the mounting: what is wrong in the same way for long."""
        return math.hypot(math.sqrt(self._covariance[0, 0]), 0.0 if self._fixed else _COMMON)

    def pass_time(self, interval: float) -> None:
        """Go on by so many seconds."""
        kept = math.exp(-interval / _SWING)
        step = np.diag([1.0, kept])
        self._state = step @ self._state
        self._covariance = step @ self._covariance @ step
        self._covariance[1, 1] += (1.0 - kept * kept) * _SPRINGS ** 2
        if not self._fixed:
            self._covariance[0, 0] += _LOAD ** 2 * min(interval / _LOADING, 1.0)

    def add_travel(self, slope: float, variance: float) -> None:
        """Take the slope of the direction of travel below the optical axis, with its variance."""
        self._add(-math.atan(slope), variance)

    def add_slides(
        self, ratio: float, apart: float, variance: float, *, assumed: float,
    ) -> None:
        """
        Take how the far road slid, over how the near one did.

        Parameters
        ----------
        ratio
            Far over near, both measured with the pitch ``assumed``.
        apart
            How much farther ahead the far road is, in heights of the camera.
        variance
            Of the ratio.
        assumed
            The pitch that the patches were made with.

        """
        steep = 2.0 * apart
        self._add(assumed + math.log(max(ratio, 1e-3)) / steep, variance / (steep * steep))

    def _add(self, pitch: float, variance: float) -> None:
        spread: NDArray[np.float64] = self._covariance.sum(axis=1)
        total = float(spread.sum())
        off = pitch - self.pitch
        variance *= max(1.0, off * off / (_FAR * _FAR * (total + variance)))
        gain = spread / (total + variance)
        self._state = self._state + gain * off
        self._covariance = self._covariance - np.outer(gain, spread)
