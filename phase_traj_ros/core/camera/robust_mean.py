# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A mean of values of which each has its own deviation, and those far off count less."""

# Farther off than this, in deviations, a value counts ever less.
_FAR = 2.0


class RobustMean:
    """The mean of values as they come, with 0 as what is known beforehand."""

    def __init__(self, deviation: float) -> None:
        """Take how far from 0 it may be beforehand (standard deviation)."""
        self._weight, self._sum = deviation ** -2, 0.0

    @property
    def mean(self) -> float:
        """Return the mean by now."""
        return self._sum / self._weight

    @property
    def deviation(self) -> float:
        """Return its standard deviation."""
        return float(self._weight ** -0.5)

    def add(self, value: float, deviation: float) -> None:
        """Take a value with its standard deviation, above 0."""
        variance = deviation * deviation
        off = (value - self.mean) ** 2 / (variance + 1.0 / self._weight)
        weight = 1.0 / (variance * max(1.0, off / _FAR ** 2))
        self._weight += weight
        self._sum += weight * value
