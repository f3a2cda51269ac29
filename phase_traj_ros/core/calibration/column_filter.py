# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Learns the column of the principal point of a camera whose focal length is given."""

import math

import numpy as np
from phase_traj_ros.core.calibration.tuning import TUNING
from phase_traj_ros.core.calibration.turn_fit import TurnFit


class ColumnFilter:
    """
    A Kalman filter over the lenses that fit the turns (``TurnFit``).

    Its states are the logarithm of the focal length in pixels, the straightness, and the column in
    pixels. The first two are nearly known, which makes the column of a fit far more certain.
    """

    def __init__(self, focal_px: float, straightness: float, width: int) -> None:
        """Start with a lens whose principal point is at about the centre of its images."""
        self._width = width
        self._lens = np.array([math.log(focal_px), straightness, 0.0])
        self._covariance = np.diag(np.square([
            TUNING.given_focal_deviation, TUNING.given_straightness_deviation,
            TUNING.given_column_deviation * width]))

    @property
    def column(self) -> float:
        """Return the column, in pixels to the right of the image centre."""
        return float(self._lens[2])

    @property
    def deviation(self) -> float:
        """Return its standard deviation in pixels."""
        return math.sqrt(float(self._covariance[2, 2]))

    def add(self, fit: TurnFit) -> None:
        """Add the lens of a part of a turn."""
        errors = (0.0, 0.0, TUNING.given_column_error * self._width)
        noise = TUNING.deviation_factor ** 2 * max(fit.cost, 1.0) * fit.covariance
        noise = noise + np.diag(np.square(errors))
        innovation = np.array([fit.log_focal, fit.straightness, fit.column]) - self._lens
        off = float(innovation @ np.linalg.solve(self._covariance + noise, innovation))
        # A fit that contradicts the given lens counts less.
        noise *= max(1.0, off / TUNING.given_gate ** 2)
        gain = np.linalg.solve(self._covariance + noise, self._covariance).T
        self._lens = self._lens + gain @ innovation
        self._covariance = self._covariance - gain @ self._covariance
