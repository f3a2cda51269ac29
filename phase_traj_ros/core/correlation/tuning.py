# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the correlation and of the tests of a shift."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class CorrelationTuning:
    """
    Tuning of the correlation and of the tests of a shift; not for users.

    Where no source is given, the value was chosen on the drives of docs/measurements/quality.md.
    """

    feather: float = 1 / 160
    """Width of the soft edge around masked-out areas, as a share of the diagonal of the frame."""

    zero_px: float = 0.75
    """A peak within this shift along each axis may be that of a fixed pattern, ..."""
    peak_distance_px: int = 8
    """...and a second peak is farther from it than this along each axis."""
    moving_again_share: float = 0.65
    """Share of the blocks that has to move before a stationary vehicle counts as driving again: a
    vehicle that crosses in front of the camera covers many of them."""
    max_shake: float = 2.0
    """Common motion of all blocks that counts as shaking, as a multiple of
    ``max_motion``."""

    block_pixels: int = 8000
    """For the blocks, a frame is reduced to about so many pixels, which averages the noise of the
    sensor away, ..."""
    max_blocks: tuple[int, int] = 4, 8
    """...and cut into at most these rows and columns of blocks..."""
    min_block_px: int = 6
    """...with at least this side."""
    min_texture_share: float = 0.02
    """A block is textured if it has this share of what a tenth of the blocks exceed."""
    min_unmasked_share: float = 0.5
    """Share of a block that the mask has to leave open."""


TUNING = CorrelationTuning()
