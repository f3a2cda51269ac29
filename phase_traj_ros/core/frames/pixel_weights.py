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

    def as_seen(self, *, rotate_180: bool) -> NDArray[np.uint8] | None:
        """Return the weight of each pixel of the upright frame, (H, W), 0 to 255."""
        if self.current is None:
            return None
        return upright((255 * self.current).astype(np.uint8), rotate_180=rotate_180)


def upright(picture: NDArray[np.uint8], *, rotate_180: bool) -> NDArray[np.uint8]:
    """Return a picture, (H, W), upright; ``rotate_180`` if the camera is mounted upside down."""
    return np.ascontiguousarray(picture[::-1, ::-1]) if rotate_180 else picture
