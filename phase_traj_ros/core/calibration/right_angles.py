# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Likelihood of focal lengths from the angles of turns, as most street corners are right angles.

A yaw measured with the focal length f' instead of f is wrong by the factor f / f', and so is the
angle of every turn. The share of right angles depends on the place and is also unknown. If it is
small, no f is much more likely than another.
"""

import math

import numpy as np
from numpy.typing import NDArray

LEAST_ANGLE_DEG = 30.0
"""Smallest angle of a turn that is used for the focal length."""

# Possible shares of right angles among the turns, with equal probability.
_RIGHT_SHARES = np.array([0.05, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9])
# Standard deviation of a right angle in degrees, shares of right angles and of U-turns, and mean
# angle of the other turns, of which small ones are more frequent. A few turns, such as on ramps of
# car parks, fit none of these: they must not favour any scale.
_ANGLE_DEVIATION = 7.0
_KINDS = ((90.0, 0.92), (180.0, 0.08))
_MEAN_BEND = 40.0
_ODD_SHARE, _DECADES = 0.05, 5.0


class RightAngles:
    """Collects the angles of turns, with constant memory."""

    def __init__(self, log_focals: NDArray[np.float64], *, weight: float = 1.0) -> None:
        """
        Make a collection without turns.

        Parameters
        ----------
        log_focals
            (N,), logarithms of the focal lengths to compare, in image widths.
        weight
            Weight of each turn, 0 to 1.

        """
        self._weight = weight
        self._focals = np.exp(log_focals)
        # By share of right angles and focal length.
        self._log = np.zeros((len(_RIGHT_SHARES), len(log_focals)))

    def add(self, angle_deg: float, *, focal: float) -> None:
        """
        Add the angle of a turn, measured with a focal length in image widths.

        Turns of less than 30 degrees are ignored.

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
        # Density of the measured angle, hence the factor of the scale.
        self._log += self._weight * np.log((shares * right + (1.0 - shares) * bend) * scales)

    @property
    def log_likelihood(self) -> NDArray[np.float64]:
        """Return the log-likelihood of each focal length, (N,)."""
        highest = self._log.max()
        total: NDArray[np.float64] = highest + np.log(np.exp(self._log - highest).sum(axis=0))
        return total


def _normal(off: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the density of right angles with an error in degrees."""
    scaled = np.exp(-0.5 * (off / _ANGLE_DEVIATION) ** 2)
    return np.asarray(scaled / (_ANGLE_DEVIATION * math.sqrt(2.0 * math.pi)), np.float64)
