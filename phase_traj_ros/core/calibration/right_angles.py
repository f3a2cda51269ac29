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

from phase_traj_ros.core.calibration.tuning import TUNING


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
        self._log = np.zeros((len(TUNING.right_shares), len(log_focals)))

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
        if abs(angle_deg) < TUNING.least_turn_deg:
            return
        scales = focal / self._focals
        true = abs(angle_deg) * scales
        u_turns = TUNING.u_turn_share
        right = (1.0 - u_turns) * _normal(true - 90.0) + u_turns * _normal(true - 180.0)
        mean, odd = TUNING.mean_bend_deg, TUNING.odd_share
        bend = (1.0 - odd) * np.exp(-true / mean) / mean + odd / (TUNING.odd_decades * true)
        shares = np.array(TUNING.right_shares)[:, None]
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
    scaled = np.exp(-0.5 * (off / TUNING.angle_deviation_deg) ** 2)
    return np.asarray(scaled / (TUNING.angle_deviation_deg * math.sqrt(2.0 * math.pi)), np.float64)
