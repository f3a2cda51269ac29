# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the angles of turns tell of the focal length, as streets mostly turn by right angles.

A yaw measured with the focal length f' in place of f is wrong by the factor f / f', and so is the
angle of every turn. How many turns are right angles depends on the place and is not known either:
where hardly any are, no f is much likelier than another.
"""

import math

import numpy as np
from numpy.typing import NDArray

LEAST_ANGLE_DEG = 30.0
"""Smaller turns tell nothing about the focal length."""

# Shares of the turns that may be right angles, one as likely as the other.
_RIGHT_SHARES = np.array([0.05, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9])
# How far a right angle in a street is from 90 degrees (deviation), how many of them are U-turns,
# and by what angle the others are on average, smaller ones being more frequent. A few turns are
# like nothing else, ramps of car parks among them: they must not count for any scale.
_ANGLE_DEVIATION = 7.0
_KINDS = ((90.0, 0.92), (180.0, 0.08))
_MEAN_BEND = 40.0
_ODD_SHARE, _DECADES = 0.05, 5.0


class RightAngles:
    """Collects the angles of turns; its memory does not grow."""

    def __init__(self, log_focals: NDArray[np.float64], *, weight: float = 1.0) -> None:
        """
        Make a collection that has seen no turn.

        Parameters
        ----------
        log_focals
            (N,), the focal lengths to judge: logarithms, in widths of the picture.
        weight
            How much each turn counts, 0 to 1.

        """
        self._weight = weight
        self._focals = np.exp(log_focals)
        # Of each share of right angles and each focal length.
        self._log = np.zeros((len(_RIGHT_SHARES), len(log_focals)))

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
        if abs(angle_deg) < LEAST_ANGLE_DEG:
            return
        scales = focal / self._focals
        true = abs(angle_deg) * scales
        right = sum(share * _normal(true - angle) for angle, share in _KINDS)
        bend = (1.0 - _ODD_SHARE) * np.exp(-true / _MEAN_BEND) / _MEAN_BEND
        bend += _ODD_SHARE / (_DECADES * true)
        shares = _RIGHT_SHARES[:, None]
        # The density is that of the measured angle: the same turn, on another scale.
        self._log += self._weight * np.log((shares * right + (1.0 - shares) * bend) * scales)

    @property
    def log_likelihood(self) -> NDArray[np.float64]:
        """Return how likely the angles are for each focal length, (N,), as a logarithm."""
        highest = self._log.max()
        total: NDArray[np.float64] = highest + np.log(np.exp(self._log - highest).sum(axis=0))
        return total


def _normal(off: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the density of a right angle that is off by so many degrees."""
    scaled = np.exp(-0.5 * (off / _ANGLE_DEVIATION) ** 2)
    return np.asarray(scaled / (_ANGLE_DEVIATION * math.sqrt(2.0 * math.pi)), np.float64)
