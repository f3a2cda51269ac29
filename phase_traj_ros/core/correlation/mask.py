# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which pixels of a frame count: a mask over what never moves, as a bonnet or burnt-in text."""

import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray
from phase_traj_ros.errors import FrameError

# Width of the soft edge around what is masked out, as a share of the frame's diagonal.
_FEATHER = 1 / 160


def mask_shares(mask: ArrayLike) -> NDArray[np.float32]:
    """
    Return how much each pixel of a mask counts, (H, W) float32, from 0 to 1.

    It counts in proportion to the largest of the mask's values: 0 to 255, 0 to 65535, 0 to 1 and
    False to True all do.

    Raises
    ------
    ValueError
        The mask is not (H, W), holds a negative value, NaN or infinity, or is empty: 0 everywhere.

    """
    values = np.asarray(mask)
    if values.ndim != 2:
        raise ValueError(f'mask has shape {values.shape}: give a grey one of shape (H, W)')
    shares = values.astype(np.float32)
    largest = float(shares.max(initial=0.0))
    if not (np.isfinite(shares).all() and shares.min(initial=0.0) >= 0.0):
        raise ValueError('mask holds NaN, infinity or a negative value: give 0 to 255, or 0 to 1')
    if largest == 0.0:
        raise ValueError('mask is 0 everywhere: nothing of the frames would be left')
    shares /= largest
    return shares


def mask_weights(mask: ArrayLike) -> NDArray[np.float32]:
    """
    Return the weights of a mask, (H, W) float32 in 0 to 1, with soft edges.

    What has the weight 0 keeps it. Around it the weights rise smoothly, as a hard edge would be a
    fixed pattern of its own: the picture's brightness ends there in every frame.

    Raises
    ------
    ValueError
        As ``mask_shares``.

    """
    weights = mask_shares(mask)
    counts = (weights > 0.0).astype(np.uint8)
    if not counts.all():
        distance = cv2.distanceTransform(counts, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        # Pixel centres next to a masked-out one are at distance 1: half a pixel from its edge.
        rise = (distance - 0.5) / (_FEATHER * math.hypot(*weights.shape))
        weights *= np.sin(np.pi / 2 * np.clip(rise, 0.0, 1.0)) ** 2
    return weights


def check_size(frame: NDArray[Any], mask: NDArray[Any]) -> None:
    """
    Make sure that a mask is of the size of a frame, (H, W) both.

    Raises
    ------
    FrameError
        It is not.

    """
    if frame.shape != mask.shape:
        (height, width), (mask_height, mask_width) = frame.shape, mask.shape
        raise FrameError(
            f'frame is {width}x{height} pixels, the mask {mask_width}x{mask_height}:'
            " give a mask of the frames' size")
