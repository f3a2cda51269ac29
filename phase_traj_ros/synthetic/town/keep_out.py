# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Areas without buildings: around the poses of a drive, and on the streets."""

from __future__ import annotations

import math

import numpy as np
from phase_traj_ros.synthetic.arrays import Bools, Floats, Ints


class KeepOut:
    """
    Discs on the ground, indexed by a grid of square cells.

    ``centers`` is (N, 2) and ``radii`` (N,), in metres. ``owners`` (N,) gives the owner of each
    disc, so that a street can ignore its own.
    """

    def __init__(self, centers: Floats, radii: Floats, owners: Ints | None = None) -> None:
        """Assign the discs to cells."""
        self._centers = np.asarray(centers, np.float64).reshape(-1, 2)
        self._radii = np.asarray(radii, np.float64)
        self._owners = np.zeros(len(radii), np.int64) if owners is None else owners
        self._reach = float(self._radii.max(initial=1.0))
        cells: dict[tuple[int, int], list[int]] = {}
        for (index, (x, y)) in enumerate(self._centers.tolist()):
            cells.setdefault((self._cell(x), self._cell(y)), []).append(index)
        self._cells = {cell: np.array(found) for (cell, found) in cells.items()}

    def _cell(self, place: float) -> int:
        return math.floor(place / self._reach)

    def _near(self, points: Floats) -> Ints:
        """Return the discs that may reach one of the points."""
        (west, south), (east, north) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        rows = range(self._cell(south) - 1, self._cell(north) + 2)
        found = [
            self._cells[column, row]
            for column in range(self._cell(west) - 1, self._cell(east) + 2) for row in rows
            if (column, row) in self._cells]
        return np.concatenate(found) if found else np.zeros(0, np.int64)

    def clear(self, points: Floats, *, ignore: int | None = None) -> Bools:
        """Return which of the points (M, 2), close together, are in no disc."""
        near = self._near(points)
        if not len(near):
            return np.ones(len(points), np.bool_)
        if ignore is not None:
            near = near[self._owners[near] != ignore]
        (dx, dy) = (points[:, None, :] - self._centers[near]).transpose(2, 0, 1)
        free: Bools = (dx * dx + dy * dy >= self._radii[near] ** 2).all(axis=1)
        return free
