# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The window that tapers a frame towards its borders, so that the borders do not correlate."""

import numpy as np
from numpy.typing import NDArray


def window_2d(shape: tuple[int, int]) -> NDArray[np.float32]:
    """
    Return the weights of a whole frame, (H, W) float32: half a sine wave along each side.

    It is the window of ``cv2.createHanningWindow``, but sampled at the centres of the pixels: no
    row or column is multiplied by 0.
    """
    rows, columns = (np.sin(np.pi * (np.arange(side) + 0.5) / side) for side in shape)
    return np.outer(rows, columns).astype(np.float32)
