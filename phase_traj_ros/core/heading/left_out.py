# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What of the frames does not count: the user's mask, and what turns out to be fixed."""

import numpy as np
from numpy.typing import NDArray


class LeftOut:
    """Puts a mask that stays together with areas that change."""

    def __init__(self, mask: NDArray[np.float32] | None) -> None:
        """Take a mask, (H, W) from 0 to 1; None for none."""
        self.mask = mask
        """How much each pixel counts at the start."""
        self._areas: NDArray[np.float32] | None = None
        self.counting = mask
        """How much each pixel counts now, (H, W) from 0 to 1; None if all count alike."""

    def use(self, weights: NDArray[np.uint8] | None) -> None:
        """Leave out where ``weights``, (H, W) from 0 to 255, are 0; None leaves out nothing."""
        self._areas = None if weights is None else np.divide(
            weights, np.float32(255), dtype=np.float32)
        self._combine()

    def keep_for(self, shape: tuple[int, ...]) -> bool:
        """Forget areas of frames of another shape; return whether there are any left."""
        if self._areas is not None and self._areas.shape != shape:
            self._areas = None
            self._combine()
        return self._areas is not None

    def as_seen(self, *, rotate_180: bool) -> NDArray[np.uint8] | None:
        """Return how much each pixel of the upright frame counts, 0 to 255."""
        counting = self.counting
        if counting is None:
            return None
        levels = (255 * counting).astype(np.uint8)
        return np.ascontiguousarray(levels[::-1, ::-1]) if rotate_180 else levels

    def _combine(self) -> None:
        if self._areas is None or self.mask is None:
            self.counting = self.mask if self._areas is None else self._areas
        else:
            self.counting = self.mask * self._areas
