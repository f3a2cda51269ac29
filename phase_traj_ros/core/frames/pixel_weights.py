# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Combines the mask of the user with the areas that are found to be fixed to the camera."""

import numpy as np
from numpy.typing import NDArray


class PixelWeights:
    """Combines a constant mask with areas that change."""

    def __init__(self, mask: NDArray[np.float32] | None) -> None:
        """Use a mask, (H, W), 0 to 1; None if all pixels count equally."""
        self.mask = mask
        """Constant weight of each pixel."""
        self._areas: NDArray[np.float32] | None = None
        self.counting = mask
        """Current weight of each pixel, (H, W), 0 to 1; None if all count equally."""

    def use(self, weights: NDArray[np.uint8] | None) -> None:
        """Leave out pixels whose ``weights``, (H, W), 0 to 255, are 0; None leaves out nothing."""
        self._areas = None if weights is None else np.divide(
            weights, np.float32(255), dtype=np.float32)
        self._combine()

    def keep_for(self, shape: tuple[int, ...]) -> bool:
        """Drop areas of another shape than the frames; return whether there are areas."""
        if self._areas is not None and self._areas.shape != shape:
            self._areas = None
            self._combine()
        return self._areas is not None

    def as_seen(self, *, rotate_180: bool) -> NDArray[np.uint8] | None:
        """Return the weight of each pixel of the upright frame, (H, W), 0 to 255."""
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
