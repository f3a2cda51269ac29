# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Areas without buildings: around the poses of a drive, and on the streets."""

from collections.abc import Sequence
import math

import numpy as np
from phase_traj_ros.synthetic.arrays import Bools, Floats


class KeepOut:
    """
    Discs on the ground, indexed by a grid of square cells.

    They have one ``radius`` in metres, and are around the points of ``lines``, (N, 2) each. One
    can ignore those of a line, by its index.
    """

    def __init__(self, lines: Sequence[Floats], radius: float) -> None:
        """Assign the discs to cells."""
        self._radius = radius
        self._centers = np.concatenate(lines)
        self._lines = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
        cells: dict[tuple[int, int], list[int]] = {}
        for (index, (x, y)) in enumerate(self._centers.tolist()):
            cells.setdefault((self._cell(x), self._cell(y)), []).append(index)
        self._cells = {cell: np.array(found) for (cell, found) in cells.items()}

    def _cell(self, place: float) -> int:
        return math.floor(place / self._radius)

    def clear(self, points: Floats, *, ignore: int | None = None) -> Bools:
        """Return which of the points (M, 2), close together, are in no disc."""
        # Of a few points, NumPy would take longer.
        (xs, ys) = points.T.tolist()
        rows = range(self._cell(min(ys)) - 1, self._cell(max(ys)) + 2)
        found = [
            self._cells[column, row]
            for column in range(self._cell(min(xs)) - 1, self._cell(max(xs)) + 2) for row in rows
            if (column, row) in self._cells]
        if not found:
            return np.ones(len(points), np.bool_)
        near = np.concatenate(found)
        if ignore is not None:
            near = near[self._lines[near] != ignore]
        (dx, dy) = (points[:, None, :] - self._centers[near]).transpose(2, 0, 1)
        free: Bools = (dx * dx + dy * dy >= self._radius ** 2).all(axis=1)
        return free
