# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Estimates the horizontal field of view for which most turns of the drive are right angles.

The estimate is a check of the lens in use, and includes its uncertainty; see ``right_angles`` for
the model. It is wrong if all turns have the same angle and this is not a right angle.
"""

from dataclasses import dataclass
import math

import numpy as np
from phase_traj_ros.core.calibration.right_angles import LEAST_ANGLE_DEG, RightAngles

ASSUMED_HFOV_DEG = 75.0
"""Assumed horizontal field of view of an unknown camera, in degrees."""
SURE = 0.9
"""Sureness from which an estimate is used."""

# Standard deviation of the prior in degrees.
_DEVIATION = 20.0
_NARROWEST, _WIDEST, _STEP = 30.0, 140.0, 0.1
# Relative error for which the sureness is given.
_NEAR = 0.05


@dataclass(frozen=True, slots=True)
class FieldOfView:
    """
    An estimate of the horizontal field of view.

    hfov_deg
        Most likely field of view in degrees, from edge to edge.
    deviation_deg
        Its standard deviation in degrees, given the turns.
    sureness
        Probability that it is correct within 5 %, 0 to 1.
    turns
        Number of turns used for the estimate.
    """

    hfov_deg: float
    deviation_deg: float
    sureness: float
    turns: int


class FieldOfViewEstimator:
    """Estimates the field of view from the angles of turns, with constant memory."""

    def __init__(self) -> None:
        """Make an estimator before the first turn."""
        self._degrees = np.arange(_NARROWEST, _WIDEST + _STEP / 2, _STEP)
        self._prior = -0.5 * ((self._degrees - ASSUMED_HFOV_DEG) / _DEVIATION) ** 2
        self._angles = RightAngles(-np.log(2.0 * np.tan(np.radians(self._degrees) / 2)))
        self._turns = 0

    def add(self, angle_deg: float, *, focal: float) -> None:
        """
        Add the angle of a turn, measured with a focal length in image widths.

        Turns of less than 30 degrees are ignored.

        Raises
        ------
        ValueError
            The angle is not finite, or the focal length is not a finite number above 0.

        """
        self._angles.add(angle_deg, focal=focal)
        self._turns += abs(angle_deg) >= LEAST_ANGLE_DEG

    @property
    def estimate(self) -> FieldOfView:
        """Return the current estimate; before the first turn, the prior."""
        log = self._prior + self._angles.log_likelihood
        density = np.exp(log - log.max())
        density /= density.sum()
        best = float(self._degrees[int(density.argmax())])
        mean = float(density @ self._degrees)
        spread = math.sqrt(float(density @ (self._degrees - mean) ** 2))
        near = np.abs(self._degrees - best) <= _NEAR * best
        return FieldOfView(best, spread, float(density[near].sum()), self._turns)
