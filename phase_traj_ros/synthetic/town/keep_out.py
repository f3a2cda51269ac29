# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Areas without buildings: around the poses of a drive, and on the streets."""

from __future__ import annotations

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
        cells = np.floor(self._centers / self._reach).astype(np.int64)
        self._cells: dict[tuple[int, int], list[int]] = {}
        for (index, (column, row)) in enumerate(cells.tolist()):
            self._cells.setdefault((column, row), []).append(index)

    def _near(self, points: Floats) -> Ints:
        low = np.floor((points.min(axis=0) - self._reach) / self._reach).astype(int)
        high = np.floor((points.max(axis=0) + self._reach) / self._reach).astype(int)
        found = [
            index
            for column in range(low[0], high[0] + 1) for row in range(low[1], high[1] + 1)
            for index in self._cells.get((column, row), ())]
        return np.array(found, np.int64)

    def clear(self, points: Floats, *, ignore: int | None = None) -> Bools:
        """Return which of the points (M, 2), close together, are in no disc."""
        near = self._near(points)
        if ignore is not None:
            near = near[self._owners[near] != ignore]
        (dx, dy) = (points[:, None, :] - self._centers[near]).transpose(2, 0, 1)
        free: Bools = (dx * dx + dy * dy >= self._radii[near] ** 2).all(axis=1)
        return free
