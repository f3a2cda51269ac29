# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Quantises a heading to directions, with hysteresis at the borders of the sectors."""

import math

from phase_traj_ros.core.codes.codes import Direction
from phase_traj_ros.core.codes.freeman import AnyDirection, Freeman
from phase_traj_ros.core.codes.tuning import TUNING


class HeadingSector:
    """Follows a heading from sector to sector, starting with that of ``FORWARD``."""

    def __init__(self, connectivity: int) -> None:
        """
        Make 4 sectors of 90 degrees (the paper's codes), or 8 of 45 degrees (Freeman's).

        Raises
        ------
        ValueError
            The connectivity is neither 4 nor 8.

        """
        if connectivity not in (4, 8):
            raise ValueError(f'connectivity is {connectivity}: give 4 or 8')
        self.directions: type[Direction] | type[Freeman] = (
            Freeman if connectivity == 8 else Direction)
        """Type of the directions: the paper's four, or Freeman's eight."""
        self._width = 2.0 * math.pi / connectivity
        self._border = self._width * (0.5 + TUNING.hysteresis)
        self._number = 0

    @property
    def direction(self) -> AnyDirection:
        """Return the direction of the current sector."""
        if self.directions is Freeman:
            return Freeman((Freeman.FORWARD + self._number) % 8)
        return Direction((Direction.FORWARD - self._number) % 4)

    def follow(self, heading: float) -> int:
        """
        Move at most one sector towards a heading; return 1 to the left, -1 to the right, else 0.

        The heading is in radians since the start, positive to the left, not wrapped.
        """
        off = heading - self._number * self._width
        step = int(off > self._border) - int(off < -self._border)
        self._number += step
        return step
