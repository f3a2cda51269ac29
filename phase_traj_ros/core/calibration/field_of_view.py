# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The horizontal field of view for which most turns of the drive are right angles.

It checks the lens in use, see ``right_angles`` for the model. The estimate says how sure it is. It
is wrong where all turns have the same angle and this is not a right angle.
"""

from dataclasses import dataclass
import math

import numpy as np
from phase_traj_ros.core.calibration.right_angles import LEAST_ANGLE_DEG, RightAngles

ASSUMED_HFOV_DEG = 75.0
"""The horizontal field of view taken for granted until something is known."""
SURE = 0.9
"""Sureness from which an estimate is worth using."""

# What is known of a camera before anything is seen: degrees across.
_DEVIATION = 20.0
_NARROWEST, _WIDEST, _STEP = 30.0, 140.0, 0.1
# An estimate counts as right within this share of it.
_NEAR = 0.05


@dataclass(frozen=True, slots=True)
class FieldOfView:
    """
    An estimate of the horizontal field of view.

    hfov_deg
        The most likely one, from edge to edge.
    deviation_deg
        Standard deviation of what it may be, given the turns.
    sureness
        Probability that it is right within 5 %, 0 to 1.
    turns
        How many turns it rests on.
    """

    hfov_deg: float
    deviation_deg: float
    sureness: float
    turns: int


class FieldOfViewEstimator:
    """Learns the field of view from the angles of turns; its memory does not grow."""

    def __init__(self) -> None:
        """Make an estimator that has seen no turn."""
        self._degrees = np.arange(_NARROWEST, _WIDEST + _STEP / 2, _STEP)
        self._prior = -0.5 * ((self._degrees - ASSUMED_HFOV_DEG) / _DEVIATION) ** 2
        self._angles = RightAngles(-np.log(2.0 * np.tan(np.radians(self._degrees) / 2)))
        self._turns = 0

    def add(self, angle_deg: float, *, focal: float) -> None:
        """
        Take the angle of one more turn, as measured with a focal length, in widths of the picture.

        Turns of less than 30 degrees tell nothing and are left out.

        Raises
        ------
        ValueError
            The angle is not finite, or the focal length is not a finite number above 0.

        """
        self._angles.add(angle_deg, focal=focal)
        self._turns += abs(angle_deg) >= LEAST_ANGLE_DEG

    @property
    def estimate(self) -> FieldOfView:
        """Return what is known by now; before the first turn, what is known of any camera."""
        log = self._prior + self._angles.log_likelihood
        density = np.exp(log - log.max())
        density /= density.sum()
        best = float(self._degrees[int(density.argmax())])
        mean = float(density @ self._degrees)
        spread = math.sqrt(float(density @ (self._degrees - mean) ** 2))
        near = np.abs(self._degrees - best) <= _NEAR * best
        return FieldOfView(best, spread, float(density[near].sum()), self._turns)
