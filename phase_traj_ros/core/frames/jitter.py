# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Estimates by how much the intervals of stamps are off.

Many cameras are stamped when their frames arrive: the transport delays some of them. The intervals
between the stamps then scatter around those between the exposures.
"""

from collections import deque
from statistics import median_low

import numpy as np
from phase_traj_ros.core.frames.tuning import TUNING


class StampJitter:
    """Keeps the newest intervals between stamps."""

    def __init__(self) -> None:
        """Make an estimate without intervals."""
        self._intervals_ns: deque[int] = deque(maxlen=TUNING.jitter_intervals)

    def add(self, interval_ns: int) -> None:
        """Add the interval between two frames of the stream."""
        self._intervals_ns.append(interval_ns)

    def deviation_ns(self, interval_ns: int) -> float:
        """
        Return the standard deviation of an interval, in nanoseconds.

        It is that of the intervals up to the median, as a longer one may be that of lost frames,
        which is as long as it seems. It is at least what this interval differs from a multiple of
        the median: the exposures are whole periods apart.
        """
        if not self._intervals_ns:
            return 0.0
        usual = median_low(self._intervals_ns)
        early = np.array([usual - each for each in self._intervals_ns if each <= usual], float)
        periods = max(round(interval_ns / usual), 1)
        return max(
            float(np.sqrt(np.mean(early ** 2))), float(abs(interval_ns - periods * usual)))
