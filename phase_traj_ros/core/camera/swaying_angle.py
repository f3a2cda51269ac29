# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Estimates an angle of the camera relative to the road: that of its mounting plus a sway."""

import math

import numpy as np
from phase_traj_ros.core.camera.tuning import TUNING


class SwayingAngle:
    """
    A Kalman filter of two states: the angle of the mounting, and the sway of the vehicle.

    The measurements are those of their sum. All angles are in radians.
    """

    def __init__(
        self, mounting: float, *, deviation: float, sway_deviation: float, sway: float = 0.0,
    ) -> None:
        """Start with both angles and their standard deviations."""
        self._state = np.array([mounting, sway])
        self._covariance = np.diag([deviation ** 2, sway_deviation ** 2])

    @property
    def mounting(self) -> float:
        """Return the angle of the mounting."""
        return float(self._state[0])

    @property
    def current(self) -> float:
        """Return the current angle."""
        return float(self._state[0] + self._state[1])

    def _fade(self, kept: float) -> None:
        """Multiply the sway by ``kept``, 0 to 1."""
        self._state[1] *= kept
        self._covariance[1] *= kept
        self._covariance[:, 1] *= kept

    def _correct(self, innovation: float, variance: float, *, slope: float = 1.0) -> None:
        """Add a measurement; ``slope`` is its derivative by the sum of both angles."""
        spread = slope * self._covariance.sum(axis=1)
        total = slope * float(spread.sum())
        limit = TUNING.outlier_deviations ** 2 * (total + variance)
        variance *= max(1.0, innovation * innovation / limit)
        gain = spread / (total + variance)
        self._state += gain * innovation
        self._covariance -= np.outer(gain, spread)

    def _deviation_of(self, part: int) -> float:
        """Return the contribution of the mounting (0) or the sway (1) to the deviation."""
        # Only the sum is measured, so the errors of both parts mostly cancel. Each contributes its
        # covariance with the sum.
        return math.sqrt(max(float(self._covariance[part].sum()), 0.0))
