# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A robust weighted mean."""

from phase_traj_ros.core.camera.tuning import TUNING


class RobustMean:
    """The running mean of values with different deviations, with a prior mean of 0."""

    def __init__(self, deviation: float) -> None:
        """Set the standard deviation of the prior."""
        self._weight, self._sum = deviation ** -2, 0.0

    @property
    def mean(self) -> float:
        """Return the current mean."""
        return self._sum / self._weight

    @property
    def deviation(self) -> float:
        """Return its standard deviation."""
        return float(self._weight ** -0.5)

    def add(self, value: float, deviation: float) -> None:
        """Add a value with its standard deviation, above 0."""
        variance = deviation * deviation
        off = (value - self.mean) ** 2 / (variance + 1.0 / self._weight)
        weight = 1.0 / (variance * max(1.0, off / TUNING.far ** 2))
        self._weight += weight
        self._sum += weight * value
