# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Measures the displacement of each block of a fixed grid, given the shift of the whole image.

The shift of the whole image follows the part with the most texture, which may be a house front on
one side. The blocks distinguish the parts of the image. They are fixed: no features are detected.
"""

from dataclasses import dataclass
import math

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.rotation.tuning import TUNING

_STOP = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, TUNING.search_steps, TUNING.search_px)


# Ratio of the standard deviation to the mean absolute value of normal errors...
_DEVIATION_BY_MEAN = math.sqrt(math.pi / 2)
# ...and variance of the difference of two pictures with whole grey values.
_ROUNDING = 1 / 6
# Square of the largest grey value, for the noise of a block that is found in no picture.
_LARGEST = 255.0 ** 2


@dataclass(slots=True, eq=False)
class BlockPicture:
    """
    A picture, (H, W) uint8, and the texture of its blocks; the other arrays are (N,).

    ``texture`` is the smaller eigenvalue of the sum of the squared gradients (g gᵀ), in grey
    values squared; 0 in a block that shows only an edge. ``weight``, from 0 to 1, follows from it;
    it is 1 from ``TUNING.full_texture`` per pixel on. Within a block, near parts move farther, so
    the displacement by least squares is that of a point ``aside`` and ``down`` of the centre of
    the block, in pixels. ``noise`` is the least variance so far of the difference to the block
    found in another picture, in grey values squared; ``BlockGrid.measure`` updates it.
    """

    pixels: NDArray[np.uint8]
    texture: NDArray[np.float64]
    weight: NDArray[np.float64]
    aside: NDArray[np.float64]
    down: NDArray[np.float64]
    noise: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BlockShifts:
    """
    Displacements of the blocks of a grid, in pixels; all arrays are (N,).

    ``dx`` is positive to the right, ``dy`` down. ``weight`` is from 0 (not measured) to 1 (much
    texture). ``precision`` is from 0 (nothing but noise) to 1 (no noise). It is 0.5 if noise
    makes the displacement as unsure as ``TUNING.block_deviation_px``.
    """

    dx: NDArray[np.float64]
    dy: NDArray[np.float64]
    weight: NDArray[np.float64]
    precision: NDArray[np.float64]

    def share_within(self, distance: float) -> float:
        """Return the share of the blocks that move by less, in pixels, by weight, 0 to 1."""
        near = np.hypot(self.dx, self.dy) < distance
        total = float(self.weight.sum())
        return float(self.weight[near].sum()) / total if total > 0.0 else 0.0

    @property
    def resting(self) -> float:
        """Return the share of the blocks that do not move, 0 to 1."""
        return self.share_within(TUNING.fixed_px)

    @property
    def moving(self) -> float:
        """Return the share of the blocks that certainly move, 0 to 1."""
        return 1.0 - self.share_within(TUNING.moving_px)


class BlockGrid:
    """
    Measures the displacement of the blocks of a fixed grid between two frames.

    Blocks that are found to be fixed to the camera, such as text overlays, dirt on the lens or the
    bonnet, have weight 0 until they move.
    """

    def __init__(self, counts: NDArray[np.bool_]) -> None:
        """Make the grid, of blocks whose centre is True in ``counts``, of the size of frames."""
        (down, across), (height, width) = TUNING.blocks, counts.shape
        y, x = (axis.ravel() for axis in np.meshgrid(
            _spaced(height, down), _spaced(width, across), indexing='ij'))
        seen = counts[y, x]
        y, x = y[seen], x[seen]
        self.centres = np.stack([x, y], axis=1).astype(np.float32)
        """Centres of the blocks in pixels, (N, 2): column, row."""
        # Pixels of each block, with a margin for the gradients, in a flattened image.
        reach = np.arange(-(TUNING.block_px // 2) - 1, TUNING.block_px // 2 + 2)
        row, column = (
            np.clip(middle[:, None] + reach, 0, side - 1)
            for middle, side in ((y, height), (x, width)))
        self._pixels = row[:, :, None] * width + column[:, None, :]
        # Place of each pixel within a block without the margin, (N, 2): column, row.
        self._offsets = np.stack(
            np.meshgrid(reach[1:-1], reach[1:-1]), axis=-1).reshape(-1, 2).astype(np.float32)
        self._fixed = np.zeros(len(x))
        self._open = np.ones(len(x), np.bool_)

    def forget(self) -> None:
        """Forget which blocks are fixed to the camera."""
        self._fixed.fill(0.0)

    def use_mask(self, counts: NDArray[np.bool_]) -> bool:
        """
        Set the weight of blocks whose centre is False in ``counts``, (H, W), to 0 from now on.

        Return False, with the state unchanged, if they would be too few to measure a motion.
        """
        columns, rows = self.centres.astype(int).T
        left = counts[rows, columns]
        if np.count_nonzero(left) < TUNING.min_blocks:
            return False
        self._open = left
        return True

    @property
    def fixed(self) -> NDArray[np.bool_]:
        """Return which blocks are found to be fixed to the camera, (N,)."""
        return self._fixed > 0.5

    def measure(
        self, previous: BlockPicture, current: NDArray[np.uint8], *,
        expected: tuple[float, float] | NDArray[np.float64],
    ) -> BlockShifts:
        """
        Return the displacements of the blocks of a picture in ``current``, (H, W) uint8.

        ``expected`` (dx, dy), in pixels, is the displacement around which all blocks are searched,
        or (N, 2) that of each block.
        """
        guess = self.centres + np.asarray(expected, np.float32)
        found, state, difference = cv2.calcOpticalFlowPyrLK(
            previous.pixels, current, self.centres, guess,
            winSize=(TUNING.block_px, TUNING.block_px), maxLevel=TUNING.pyramid_levels,
            criteria=_STOP, minEigThreshold=TUNING.min_texture, flags=cv2.OPTFLOW_USE_INITIAL_FLOW)
        moved = (found - self.centres).astype(np.float64)
        is_found = state.ravel() == 1
        # OpenCV leaves the difference of a block undefined that it did not find.
        noise = np.square(_DEVIATION_BY_MEAN * np.where(is_found, difference.ravel(), np.inf))
        # Near objects grow with time, which is not noise.
        previous.noise = np.minimum(previous.noise, noise)
        measured = is_found & self._open & ~self.fixed
        return BlockShifts(
            moved[:, 0], moved[:, 1], np.where(measured, previous.weight, 0.0),
            self._precision(previous))

    def _precision(self, picture: BlockPicture) -> NDArray[np.float64]:
        """
        Return the precision of the displacements of the blocks of a picture, (N,).

        Noise looks like texture: a central difference of one picture has a quarter of the variance
        that the difference of two pictures has. Only the real texture moves with the block, so
        the variance of a displacement by least squares is that of the noise times the texture,
        divided by the square of the real texture. A share of the texture is always real: a sharp
        picture differs from a blurred one by more than the noise of either, in all blocks.
        """
        noise = np.clip(picture.noise, _ROUNDING, _LARGEST)
        real = np.maximum(
            picture.texture - len(self._offsets) * noise / 4,
            TUNING.min_texture_share * picture.texture)
        signal = TUNING.block_deviation_px ** 2 * real * real
        return signal / np.maximum(signal + noise * picture.texture, 1e-9)

    def extract(self, picture: NDArray[np.uint8]) -> BlockPicture:
        """Return a picture, (H, W), whose blocks can be found in others; it must not change."""
        pixels = picture.ravel()[self._pixels].astype(np.float32)
        x = (pixels[:, 1:-1, 2:] - pixels[:, 1:-1, :-2]).reshape(len(pixels), -1) / 2
        y = (pixels[:, 2:, 1:-1] - pixels[:, :-2, 1:-1]).reshape(len(pixels), -1) / 2
        xx, both, yy = x * x, x * y, y * y
        across, down = self._offsets.T
        moment_x, moment_y = xx @ across + both @ down, both @ across + yy @ down
        xx, xy, yy = (each.sum(axis=1) for each in (xx, both, yy))
        half, apart = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
        corners = half - apart > TUNING.min_corner * (half + apart)
        texture = np.where(corners, half - apart, 0.0).astype(np.float64)
        weight = np.minimum(texture / len(self._offsets) / TUNING.full_texture, 1.0)
        # The mean place, weighted with the matrices of the gradients, as least squares weigh.
        determinant = np.where(corners, xx * yy - xy * xy, np.inf)
        aside = (yy * moment_x - xy * moment_y) / determinant
        down = (xx * moment_y - xy * moment_x) / determinant
        return BlockPicture(
            picture, texture, weight, aside.astype(np.float64), down.astype(np.float64),
            noise=np.full(len(texture), np.inf))

    def learn(self, shifts: BlockShifts, must_move: NDArray[np.bool_]) -> None:
        """Learn which blocks are fixed, of those (N,) in which any scene must have moved."""
        distance = np.hypot(shifts.dx, shifts.dy)
        still = must_move & (distance < TUNING.fixed_px)
        self._fixed[still] += TUNING.fixing_rate * (1.0 - self._fixed[still])
        self._fixed[distance > TUNING.moving_px] *= TUNING.releasing_factor


def _spaced(side: int, count: int) -> NDArray[np.intp]:
    """Return the centres of blocks along a side: whole pixels, and the same in the mirror."""
    before = ((np.arange(count // 2) + 0.5) * side / count).astype(np.intp)
    return np.concatenate([before, side - 1 - before[::-1]])
