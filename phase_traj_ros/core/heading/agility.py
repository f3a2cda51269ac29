# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The agility of a vehicle, learned from its drive: how fast its yaw rate changes.

A model car changes its yaw rate faster than a car can. The yaw rate is modelled as a random walk.
Its process noise is estimated from the changes of the rate between certain pairs.
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
        """Forget the last rate and keep the process noise: the next pair shows another scene."""
        self._rate: float | None = None
        # Time since that rate; yaw and time of the certain pairs in a row.
        self._since = self._turned = self._duration = 0.0

    def scale(self, factor: float) -> None:
        """Multiply all angles so far by a factor, to correct them."""
        self.process_noise *= factor * factor
        self._turned *= factor
        self._rate = None if self._rate is None else self._rate * factor

    def add(self, yaw: float | None, interval: float) -> None:
        """
        Add the yaw of the next pair of frames in radians, and its time in seconds, above 0.

        The yaw is None if it is missing or uncertain: learning from uncertain pairs would admit
        more of them.
        """
        self._since += interval
        if yaw is None:
            self._turned = self._duration = 0.0
            return
        self._turned += yaw
        self._duration += interval
        # The rate of a short pair errs by the jitter of its stamps.
        if self._duration < TUNING.min_rate_time_s:
            return
        rate, before = self._turned / self._duration, self._rate
        if before is not None:
            change = min(TUNING.max_rate_change, abs(rate - before))
            kept = math.exp(-self._since / TUNING.process_s)
            # Means of a random walk over the time that each of the two rates lasted.
            self.process_noise = kept * self.process_noise + (1.0 - kept) * change ** 2 / (
                self._since - self._duration / 3.0)
        self._rate = rate
        self._since = self._turned = self._duration = 0.0
