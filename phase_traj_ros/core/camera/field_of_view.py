# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The camera's field of view from the drive itself: streets mostly turn by right angles.

A yaw measured with the wrong focal length f' is wrong by the factor f / f'. So is the angle of
every turn, and the f that makes multiples of right angles of most of them is the likeliest. How
many turns are right angles depends on the place and is not known either: where hardly any are, no
f is much likelier than another, and the estimate says that it is not sure. Only of turns that are
all alike, and no right angles, it must be wrong.
"""

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

ASSUMED_HFOV_DEG = 75.0
"""The horizontal field of view taken for granted until something is known."""
SURE = 0.9
"""Sureness from which an estimate is worth using."""

# What is known of a camera before anything is seen: degrees across.
_DEVIATION = 20.0
_NARROWEST, _WIDEST, _STEP = 30.0, 140.0, 0.1
# Shares of the turns that may be right angles, one as likely as the other.
_RIGHT_SHARES = np.array([0.05, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9])
# How far a right angle in a street is from 90 degrees (deviation), how many of them are U-turns,
# and by what angle the others are on average, smaller ones being more frequent. A few turns are
# like nothing else, ramps of car parks among them: they must not count for any scale.
_ANGLE_DEVIATION = 7.0
_KINDS = ((90.0, 0.92), (180.0, 0.08))
_MEAN_BEND = 40.0
_ODD_SHARE, _DECADES = 0.05, 5.0
_LEAST_DEG = 30.0
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
        # In widths of the picture.
        self._focals = 0.5 / np.tan(np.radians(self._degrees) / 2)
        # Of each share of right angles and each field of view.
        self._log: NDArray[np.float64] = np.tile(
            -0.5 * ((self._degrees - ASSUMED_HFOV_DEG) / _DEVIATION) ** 2,
            (len(_RIGHT_SHARES), 1))
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
        if not math.isfinite(angle_deg):
            raise ValueError(f'angle_deg is {angle_deg}: give a finite angle')
        if not (math.isfinite(focal) and focal > 0):
            raise ValueError(f'focal is {focal}: give a finite number of widths above 0')
        if abs(angle_deg) < _LEAST_DEG:
            return
        self._turns += 1
        scales = focal / self._focals
        true = abs(angle_deg) * scales
        right = sum(share * _normal(true - angle) for angle, share in _KINDS)
        bend = (1.0 - _ODD_SHARE) * np.exp(-true / _MEAN_BEND) / _MEAN_BEND
        bend += _ODD_SHARE / (_DECADES * true)
        shares = _RIGHT_SHARES[:, None]
        # The density is that of the measured angle: the same turn, on another scale.
        self._log += np.log((shares * right + (1.0 - shares) * bend) * scales)

    @property
    def estimate(self) -> FieldOfView:
        """Return what is known by now; before the first turn, what is known of any camera."""
        density = np.exp(self._log - self._log.max()).sum(axis=0)
        density /= density.sum()
        best = float(self._degrees[int(density.argmax())])
        mean = float(density @ self._degrees)
        spread = math.sqrt(float(density @ (self._degrees - mean) ** 2))
        near = np.abs(self._degrees - best) <= _NEAR * best
        return FieldOfView(best, spread, float(density[near].sum()), self._turns)


def _normal(off: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the density of a right angle that is off by so many degrees."""
    scaled = np.exp(-0.5 * (off / _ANGLE_DEVIATION) ** 2)
    return scaled / (_ANGLE_DEVIATION * math.sqrt(2.0 * math.pi))
