# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Estimates an angle of the camera relative to the road: that of its mounting plus a sway."""

import math

import numpy as np
from phase_traj_ros.core.camera.tuning import TUNING


def mounting_drift(interval: float) -> float:
    """Return the variance by which an angle of the mounting changes within seconds, in rad2."""
    return TUNING.mounting_drift ** 2 * min(interval / TUNING.mounting_drift_s, 1.0)


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

    def _fade(
        self, interval: float, *, time: float, deviation: float, lasts: bool = False,
    ) -> None:
        """
        Forget the sway with a ``time`` constant in seconds, unless it ``lasts``.

        Its standard deviation tends to ``deviation``.
        """
        kept = math.exp(-interval / time)
        if not lasts:
            self._state[1] *= kept
            self._covariance[1] *= kept
            self._covariance[:, 1] *= kept
        self._covariance[1, 1] += (1.0 - kept * kept) * deviation ** 2

    def _forget(self, deviation: float) -> None:
        """Restart without a sway, with this standard deviation; the mounting is kept."""
        self._state[1] = self._covariance[0, 1] = self._covariance[1, 0] = 0.0
        self._covariance[1, 1] = deviation ** 2

    def _correct(self, innovation: float, variance: float, *, slope: float = 1.0) -> None:
        """Add a measurement; ``slope`` is its derivative by the sum of both angles."""
        spread = slope * self._covariance.sum(axis=1)
        total = slope * float(spread.sum())
        limit = TUNING.outlier_deviations ** 2 * (total + variance)
        variance *= max(1.0, innovation * innovation / limit)
        gain = spread / (total + variance)
        self._state += gain * innovation
        self._covariance -= np.outer(gain, spread)
