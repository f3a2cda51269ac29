# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
How fast the yaw rate of a vehicle changes, learned from its own drive.

A car cannot do what a model car does at every corner. The yaw rate is modelled as a random walk,
whose process noise follows from the changes of the rate between pairs that are certain.
"""

import math

from phase_traj_ros.core.heading.tuning import TUNING


class Agility:
    """Learns the process noise of the yaw rate."""

    def __init__(self) -> None:
        """Start with a vehicle that has not changed its rate."""
        self.process_noise = 0.0
        """Variance that the yaw rate gains per second, in (rad/s)^2/s."""
        self.cut()

    def cut(self) -> None:
        """Forget the last rate, but not what was learned: the next pair shows another scene."""
        self._rate: float | None = None
        # Time since that rate; yaw and time of the certain pairs in a row.
        self._since = self._turned = self._lasted = 0.0

    def scale(self, factor: float) -> None:
        """Multiply all angles so far by a factor, to correct them."""
        self.process_noise *= factor * factor
        self._turned *= factor
        self._rate = None if self._rate is None else self._rate * factor

    def add(self, yaw: float | None, interval: float) -> None:
        """
        Add the yaw of the next pair of frames in radians, and its time in seconds, above 0.

        The yaw is None if it is missing or in doubt: what is learned from doubtful pairs would
        admit more of them.
        """
        self._since += interval
        if yaw is None:
            self._turned = self._lasted = 0.0
            return
        self._turned += yaw
        self._lasted += interval
        # The rate of a short pair errs by the jitter of its stamps.
        if self._lasted < TUNING.process_least_s:
            return
        rate, before = self._turned / self._lasted, self._rate
        if before is not None:
            change = min(TUNING.process_most, abs(rate - before))
            kept = math.exp(-self._since / TUNING.process_s)
            # Means of a random walk over the time that each of the two rates lasted.
            self.process_noise = kept * self.process_noise + (1.0 - kept) * change ** 2 / (
                self._since - self._lasted / 3.0)
        self._rate = rate
        self._since = self._turned = self._lasted = 0.0
