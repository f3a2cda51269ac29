# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The camera's field of view from the drive itself: streets mostly turn by right angles.

A yaw measured with the wrong focal length f' is wrong by the factor f / f'. So is the angle of
every turn, and the f that makes multiples of right angles of most of them is the likeliest.
"""

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.projection import focal_from_hfov, hfov_from_focal

# What is known of a camera before anything is seen: degrees across.
_EXPECTED, _EXPECTED_DEVIATION = 75.0, 20.0
_NARROWEST, _WIDEST, _STEP = 30.0, 140.0, 0.1
# How far a right angle in a street is from 90 degrees (deviation), how often a turn is a single or
# a double one, and how often it is a bend by any angle, smaller ones more often than larger ones
# (mean, degrees).
_ANGLE_DEVIATION = 7.0
_SHARES = ((90.0, 0.6), (180.0, 0.05))
_BENDS, _MEAN_BEND = 0.35, 40.0
# An estimate counts as sure to this accuracy.
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

    def __init__(self, width: int, *, assumed_focal_px: float) -> None:
        """
        Make an estimator that has seen no turn.

        Parameters
        ----------
        width
            Of the frames, in pixels.
        assumed_focal_px
            The focal length that the turns' angles are measured with, in pixels.

        """
        self._degrees = np.arange(_NARROWEST, _WIDEST + _STEP / 2, _STEP)
        focals = np.array([focal_from_hfov(each, width) for each in self._degrees])
        self._scales = assumed_focal_px / focals
        self._log: NDArray[np.float64] = -0.5 * (
            (self._degrees - _EXPECTED) / _EXPECTED_DEVIATION) ** 2
        self._turns = 0

    def add(self, angle_deg: float) -> None:
        """
        Take the angle of one more turn, as measured with the assumed focal length.

        Turns of less than 30 degrees tell nothing and are left out.

        Raises
        ------
        ValueError
            The angle is not finite.

        """
        if not math.isfinite(angle_deg):
            raise ValueError(f'angle_deg is {angle_deg}: give a finite angle')
        if abs(angle_deg) < 30.0:
            return
        self._turns += 1
        true = abs(angle_deg) * self._scales
        likelihood = _BENDS / _MEAN_BEND * np.exp(-true / _MEAN_BEND)
        for angle, share in _SHARES:
            likelihood += share / (_ANGLE_DEVIATION * math.sqrt(2 * math.pi)) * np.exp(
                -0.5 * ((true - angle) / _ANGLE_DEVIATION) ** 2)
        # The density is that of the measured angle: the same turn, on another scale.
        self._log += np.log(likelihood * self._scales)

    @property
    def estimate(self) -> FieldOfView:
        """Return what is known by now; before the first turn, what is known of any camera."""
        density = np.exp(self._log - self._log.max())
        density /= density.sum()
        best = float(self._degrees[int(density.argmax())])
        mean = float(density @ self._degrees)
        spread = math.sqrt(float(density @ (self._degrees - mean) ** 2))
        near = np.abs(self._degrees - best) <= _NEAR * best
        return FieldOfView(best, spread, float(density[near].sum()), self._turns)


def scale_between(hfov_deg: float, assumed_focal_px: float, width: int) -> float:
    """Return what to multiply yaws with that were measured with an assumed focal length."""
    return assumed_focal_px / focal_from_hfov(hfov_deg, width)


__all__ = ['FieldOfView', 'FieldOfViewEstimator', 'hfov_from_focal', 'scale_between']
