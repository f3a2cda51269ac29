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
        self.current = mask
        """Current weight of each pixel, (H, W), 0 to 1; None if all count equally."""

    def use(self, weights: NDArray[np.uint8] | None) -> None:
        """Leave out pixels whose ``weights``, (H, W), 0 to 255, are 0; None leaves out nothing."""
        self.current = self.mask
        if weights is not None:
            areas = np.divide(weights, np.float32(255), dtype=np.float32)
            self.current = areas if self.mask is None else self.mask * areas

    def keep_for(self, shape: tuple[int, ...]) -> bool:
        """Drop areas of another shape than the frames; return whether there are areas."""
        if self.current is not None and self.current.shape != shape:
            self.current = self.mask
        return self.current is not self.mask

    @property
    def in_8_bits(self) -> NDArray[np.uint8] | None:
        """Return the current weight of each pixel, (H, W), 0 to 255; None if all count equally."""
        return None if self.current is None else (255 * self.current).astype(np.uint8)
