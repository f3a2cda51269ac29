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

    @property
    def deviation_ns(self) -> float:
        """
        Return the standard deviation of an interval, in nanoseconds.

        It is that of the intervals that are near the median. The others are those of lost frames
        or of another rate, and are as long as they seem.
        """
        if not self._intervals_ns:
            return 0.0
        usual = median_low(self._intervals_ns)
        off = np.array(self._intervals_ns) - usual
        near = off[np.abs(off) < TUNING.jitter_outlier_share * usual]
        return float(np.sqrt(np.mean(np.square(near, dtype=np.float64))))
