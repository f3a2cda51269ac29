# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Estimates by how much the intervals of stamps are off.

Many cameras are stamped when their frames arrive: the transport delays some of them. The intervals
between the stamps then scatter around those between the exposures.
"""

from collections import deque
from itertools import pairwise
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
        Return the standard deviation of the next interval, in nanoseconds.

        It is that of the intervals up to the period of the camera, and at least what this interval
        differs from a whole number of periods. A longer interval spans lost frames, or its frame
        is late: then the exposures are one period apart, which is three deviations less. While the
        period is not known, three deviations are the longest interval so far.
        """
        if len(self._intervals_ns) < TUNING.fewest_intervals:
            return max(interval_ns, *self._intervals_ns, 0) / 3.0
        # A late stamp makes one interval too long by what the next one is too short.
        period = median_low((before + after) / 2 for before, after in pairwise(self._intervals_ns))
        early = np.array([period - each for each in self._intervals_ns if each <= period])
        whole = max(round(interval_ns / period), 1) * period
        return max(
            float(np.sqrt(np.mean(early ** 2))), abs(interval_ns - whole),
            (interval_ns - period) / 3.0)
