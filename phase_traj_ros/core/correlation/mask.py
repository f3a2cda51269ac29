# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The mask: how much each pixel of a frame counts, e.g. 0 on the bonnet or on burnt-in text."""

import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray
from phase_traj_ros.core.correlation.tuning import TUNING
from phase_traj_ros.errors import FrameError


def mask_shares(mask: ArrayLike) -> NDArray[np.float32]:
    """
    Return the weight of each pixel of a mask, (H, W) float32, 0 to 1.

    Weights are relative to the largest value of the mask, so the ranges 0 to 255, 0 to 65535,
    0 to 1 and False to True are equivalent.

    Raises
    ------
    ValueError
        The mask is not (H, W), holds a negative value, NaN or infinity, or is empty (all 0).

    """
    values = np.asarray(mask)
    if values.ndim != 2:
        raise ValueError(f'mask has shape {values.shape}: give a greyscale mask of shape (H, W)')
    shares = values.astype(np.float32)
    largest = float(shares.max(initial=0.0))
    if not (np.isfinite(shares).all() and shares.min(initial=0.0) >= 0.0):
        raise ValueError('mask holds NaN, infinity or a negative value: give 0 to 255, or 0 to 1')
    if largest == 0.0:
        raise ValueError('mask is empty (0 everywhere): no part of the frames would be used')
    shares /= largest
    return shares


def mask_weights(mask: ArrayLike) -> NDArray[np.float32]:
    """
    Return the weights of a mask with soft edges, (H, W) float32, 0 to 1.

    Pixels of weight 0 keep it. Around them the weights rise smoothly: a hard edge would itself be
    a fixed pattern, because the brightness drops there in every frame.

    Raises
    ------
    ValueError
        As ``mask_shares``.

    """
    weights = mask_shares(mask)
    counts = (weights > 0.0).astype(np.uint8)
    if not counts.all():
        distance = cv2.distanceTransform(counts, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        # Centres of pixels next to a masked-out one are at distance 1: half a pixel from its edge.
        rise = (distance - 0.5) / (TUNING.feather * math.hypot(*weights.shape))
        weights *= np.sin(np.pi / 2 * np.clip(rise, 0.0, 1.0)) ** 2
    return weights


def check_size(frame: NDArray[Any], mask: NDArray[Any]) -> None:
    """
    Check that a mask and a frame, both (H, W), have the same size.

    Raises
    ------
    FrameError
        The sizes differ.

    """
    if frame.shape != mask.shape:
        (height, width), (mask_height, mask_width) = frame.shape, mask.shape
        raise FrameError(
            f'frame is {width}x{height} pixels, the mask {mask_width}x{mask_height}:'
            ' give a mask of the same size as the frames')
