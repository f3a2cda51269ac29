# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A drawn path as lines of text, for a terminal."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Axes, Corner, to_axes

# Bit of each dot of a braille character in Unicode, by row and column.
_DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_BLANK = 0x2800


def path_lines(
    corners: Sequence[Corner], *, columns: int, rows: int, braille: bool = True,
) -> list[str]:
    """
    Return a path as ``rows`` lines of at most ``columns`` characters, its start heading up.

    Parameters
    ----------
    corners
        Start, turns and end of the path, oldest first.
    columns, rows
        Size of the text, at least 1 each.
    braille
        Whether to use Unicode braille characters, which hold 2 x 4 dots each; otherwise ASCII.

    """
    # A character is about twice as high as wide: braille dots are square, whole characters not.
    across, down = (2, 4) if braille else (1, 1)
    width, height = columns * across, rows * down
    stretch = 1.0 if braille else 2.0
    grid = np.zeros((height, width), bool)
    if corners:
        points = to_axes(
            np.array([(corner.x, corner.y) for corner in corners], np.float64), Axes.FIGURE)
        places = _fitted(points * (stretch, 1.0), width, height)
        for (x, y), (to_x, to_y) in pairwise(places):
            grid[min(y, to_y):max(y, to_y) + 1, min(x, to_x):max(x, to_x) + 1] = True
        grid[places[0][1], places[0][0]] = True
    if not braille:
        return [''.join('*' if dot else ' ' for dot in row).rstrip() for row in grid]
    cells = grid.reshape(rows, 4, columns, 2).transpose(0, 2, 1, 3)
    signs = (cells * _DOTS).sum(axis=(2, 3))
    return [''.join(chr(_BLANK + int(sign)) if sign else ' ' for sign in row).rstrip()
            for row in signs]


def _fitted(points: NDArray[np.float64], width: int, height: int) -> list[tuple[int, int]]:
    """Return points (x right, y up) as columns and rows of a grid, as large as possible."""
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    room = np.array([width - 1, height - 1], np.float64)
    # At most one dot per step, so that a path that has just begun is short.
    scale = min(1.0, *(room / np.maximum(extent, 1e-9)))
    moved = (points - low) * scale + (room - extent * scale) / 2
    return [(round(x), round(height - 1 - y)) for x, y in moved.tolist()]
