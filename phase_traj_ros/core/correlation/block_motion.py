# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Displacements of the blocks of an image: an inexpensive second opinion on a pair of frames.

Both frames are reduced to some thousands of pixels and cut into blocks. Unlike a shift of the
whole frame, the blocks show whether anything moves, and which of two shifts most of them follow.
"""

from dataclasses import dataclass
import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray
from phase_traj_ros.core.correlation.mask import mask_weights
from phase_traj_ros.core.correlation.phase_correlation import Frame, Shift
from phase_traj_ros.core.correlation.tuning import TUNING
from phase_traj_ros.core.correlation.view import halvings, reduced


@dataclass(frozen=True, slots=True, eq=False)
class BlockFlow:
    """
    Displacements of the blocks between two frames.

    vectors
        (n, 2) displacements in pixels of the frame, x to the right and y downwards.
    textured
        (n,) whether a block has enough texture for its vector to be valid.
    """

    vectors: NDArray[np.float64]
    textured: NDArray[np.bool_]


class BlockMotion:
    """Keeps two consecutive frames, reduced, and compares them block by block."""

    def __init__(self, *, mask: ArrayLike | None = None) -> None:
        """
        Make a comparison that waits for its first frame.

        ``mask`` is the correlator's. Blocks of which it leaves less than half open are ignored.

        Raises
        ------
        ValueError
            The mask is invalid (see ``mask_shares``).

        """
        self._mask = None if mask is None else mask_weights(mask)
        self._excluded: NDArray[np.float32] | None = None
        self._form: tuple[tuple[int, ...], np.dtype[Any]] | None = None
        # The newest and the previous frame, reduced; empty if there is none.
        self._current = self._previous = np.empty((0, 0), np.float32)

    def exclude(self, weights: ArrayLike | None) -> None:
        """Ignore areas in addition to the mask, from (H, W) weights; None for none."""
        self._excluded = None if weights is None else mask_weights(weights)
        if self._form is not None:
            self._open = self._open_blocks()

    def update(self, frame: Frame) -> bool:
        """
        Take the next frame, (H, W), of a type and a size that the correlator accepts.

        Return whether there is a previous frame to compare it with. There is none at the start
        and after a change of size or type.
        """
        if (frame.shape, frame.dtype) != self._form:
            self._begin(frame.shape, frame.dtype)
        self._previous = self._current
        self._current = reduced(frame, self._scale, self._scale).astype(np.float32)
        return self._previous.size > 0

    def flow(self) -> BlockFlow:
        """
        Return the displacement of each block, by one least-squares step (Lucas and Kanade, 1981).

        Changes of a block's brightness and contrast are allowed for. Displacements are valid up to
        about a pixel of the reduced frames. Larger ones give wrong vectors, but rarely small ones.
        """
        rows, tall, columns, wide = self._split
        height, width = rows * tall, columns * wide
        both = self._current + self._previous
        down, right = slice(1, height + 1), slice(1, width + 1)
        # In the sum of both frames, central differences are four times the mean gradient.
        parts = np.stack([
            both[down, 2:width + 2] - both[down, :width],
            both[2:height + 2, right] - both[:height, right], both[down, right],
            self._current[down, right] - self._previous[down, right]])
        blocks = parts.reshape(4, *self._split).transpose(1, 3, 0, 2, 4)
        samples = blocks.reshape(rows * columns, 4, tall * wide)
        samples -= samples.mean(axis=2, keepdims=True)
        return self._solve((samples @ samples.transpose(0, 2, 1)).astype(np.float64))

    def share_following(self, shift: Shift) -> float:
        """
        Return the share of the textured blocks that ``shift`` explains better than no motion.

        Content that the shift brings in from outside the frame is ignored. 0 if no block is left.
        """
        height, width = self._current.shape
        matrix = np.array([[1.0, 0.0, shift.dx / self._scale], [0.0, 1.0, shift.dy / self._scale]])
        moved = cv2.warpAffine(
            self._previous, matrix, (width, height), flags=cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT, borderValue=(math.nan,) * 4)
        # The level is subtracted so that the sums of squares keep their precision.
        parts = np.stack([
            self._current - self._previous, self._current - moved,
            self._current - self._current.mean(), np.ones_like(moved)])
        parts = np.where(np.isfinite(moved), parts, np.float32(0))
        rows, tall, columns, wide = self._split
        split = parts[:, 1:rows * tall + 1, 1:columns * wide + 1].reshape(4, *self._split)
        squares = np.square(split[:3]).sum(axis=(2, 4))
        sums = split.sum(axis=(2, 4))
        count = np.maximum(sums[3], 1.0)
        still, moving, texture = squares / count - np.square(sums[:3] / count)
        follows = (moving < still).ravel()[self._textured(texture.ravel())]
        return float(follows.mean()) if len(follows) else 0.0

    def _solve(self, moments: NDArray[np.float64]) -> BlockFlow:
        across, along = moments[:, 0, 0], moments[:, 1, 1]
        weaker = (across + along - np.hypot(across - along, 2.0 * moments[:, 0, 1])) / 2.0
        known = moments[:, :3, :3]
        # Keeps blocks without texture solvable, and does not affect the others.
        lift = 1e-6 * float(np.trace(known, axis1=1, axis2=2).mean()) + np.finfo(np.float32).tiny
        solved = np.linalg.solve(known + lift * np.eye(3), moments[:, :3, 3:])[:, :2, 0]
        # Where brightness rises to the right, growing brightness means motion to the left.
        return BlockFlow(vectors=solved * (-4.0 * self._scale), textured=self._textured(weaker))

    def _textured(self, texture: NDArray[np.floating[Any]]) -> NDArray[np.bool_]:
        """Return which blocks, (n,), have enough texture and are not masked out."""
        candidates = texture[self._open]
        if not len(candidates):
            return self._open
        rank = len(candidates) * 9 // 10
        least = TUNING.min_texture_share * np.partition(candidates, rank)[rank]
        enough: NDArray[np.bool_] = texture > least
        return self._open & enough

    def _begin(self, shape: tuple[int, int], dtype: np.dtype[Any]) -> None:
        """Cut frames of this form into blocks; there is no previous frame."""
        self._form = shape, dtype
        self._scale = 2 ** halvings(
            shape, pixels=TUNING.block_pixels, least=TUNING.min_block_px + 2)
        self._size = height, width = shape[0] // self._scale, shape[1] // self._scale
        # Differences are taken within the frame, so no block contains its border.
        rows, columns = (
            max(min(most, (side - 2) // TUNING.min_block_px), 1)
            for most, side in zip(TUNING.max_blocks, (height, width)))
        self._split = rows, (height - 2) // rows, columns, (width - 2) // columns
        self._current = np.empty((0, 0), np.float32)
        self._open = self._open_blocks()

    def _open_blocks(self) -> NDArray[np.bool_]:
        """Return which blocks the mask and the areas left out leave open, (n,)."""
        rows, tall, columns, wide = self._split
        height, width = self._size
        opened = np.ones(rows * columns, np.bool_)
        for mask in (self._mask, self._excluded):
            if mask is not None:
                weights = cv2.resize(mask, (width, height), interpolation=cv2.INTER_AREA)
                inner = weights[1:rows * tall + 1, 1:columns * wide + 1]
                share = inner.reshape(self._split).mean(axis=(1, 3)).ravel()
                opened &= share >= TUNING.min_unmasked_share
        return opened
