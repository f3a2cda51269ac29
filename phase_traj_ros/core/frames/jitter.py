# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Estimates by how much the intervals of stamps are off.

Many cameras are stamped when their frames arrive: the transport delays some of them. The intervals
between the stamps then scatter around those between the exposures.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray
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
        is late: then the exposures are one period apart, which is three deviations less.
        """
        if len(self._intervals_ns) < TUNING.fewest_intervals:
            return TUNING.first_deviation * interval_ns
        intervals = np.array(self._intervals_ns, float)
        period = _period(intervals)
        early = period - intervals[intervals <= period]
        beyond = _rms(_beyond(np.array([float(interval_ns)]), period))
        return max(_rms(early), beyond, (interval_ns - period) / 3.0)


def _period(intervals: NDArray[np.float64]) -> float:
    """Return the probable period of the exposures, from the intervals between stamps, (N,)."""
    period = _lower_median(intervals)
    exact = _rms(_beyond(intervals, period)) < TUNING.exact_share * period
    if exact and np.mean(intervals) < TUNING.max_exact_periods * period:
        return period
    # A late stamp makes one interval too long by what the next one is too short.
    return _lower_median((intervals[1:] + intervals[:-1]) / 2.0)


def _beyond(intervals: NDArray[np.float64], period: float) -> NDArray[np.float64]:
    """Return by how much intervals exceed the nearest multiple of the period, (N,)."""
    return intervals - np.maximum(np.round(intervals / period), 1.0) * period


def _lower_median(values: NDArray[np.float64]) -> float:
    return float(np.sort(values)[(len(values) - 1) // 2])


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values ** 2)))
