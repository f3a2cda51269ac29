# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What all pictures of the road have in common.

Reflections on the windscreen, dirt and the grid of an encoder do not move, and where the asphalt
shows little, their peak at zero is higher than that of the road. The road itself averages out
while it passes by.
"""

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.road.tuning import TUNING


class FixedPattern:
    """Learns the mean of the patches of a moving road."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self._mean: NDArray[np.float32] | None = None
        self._count = 0

    def learn(self, patch: NDArray[np.float32]) -> None:
        """Add a patch, (M, N), of a road that has moved on since the last one."""
        self._count = min(self._count + 1, TUNING.pattern_patches)
        if self._mean is None:
            self._mean = patch.copy()
        else:
            self._mean += (patch - self._mean) / np.float32(self._count)

    def removed(self, patch: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return a patch without the pattern."""
        if self._mean is None or self._count < TUNING.least_patches:
            return patch
        return patch - self._mean
