# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Windows that taper a frame towards its borders, so that the borders do not correlate."""

from enum import Enum
from typing import cast

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.tuning import TUNING


class Window(Enum):
    """
    Taper of a frame before its transform; separable, equal along rows and columns.

    All windows are sampled at the centres of the pixels: no row or column is multiplied by 0.
    """

    SQRT_HANN = 'sqrt_hann'
    """Half a sine wave, as ``cv2.createHanningWindow``, which samples from border to border."""
    HANN = 'hann'
    """A raised cosine: less leakage, but it uses less of the frame."""
    TUKEY = 'tukey'
    """Flat, with a cosine taper over the outer eighth at each end."""

    def values(self, length: int) -> NDArray[np.float64]:
        """Return the ``length`` weights of one side, each in (0, 1]."""
        position = (np.arange(length) + 0.5) / length
        if self is Window.TUKEY:
            position = np.minimum(position, 1.0 - position) / TUNING.tukey_taper
            position = np.minimum(position, 0.5)
        power = 1 if self is Window.SQRT_HANN else 2
        return cast('NDArray[np.float64]', np.sin(np.pi * position) ** power)


def window_2d(window: Window, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Return the weights of a whole frame, (H, W) float32."""
    rows, columns = (window.values(side) for side in shape)
    return np.outer(rows, columns).astype(np.float32)
