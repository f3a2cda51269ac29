# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The road map: directed pieces of road, and which follow which."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class RoadMap:
    """
    Roads as directed pieces of at most 5 m, in metres, x to the east and y to the north.

    Each piece of road is here twice, once per direction. Make it with `from_ways` or
    `from_polylines`.

    starts, ends
        Where each piece starts and ends, (N, 2).
    length, direction
        Length in metres and direction in radians, counter-clockwise from the east, (N,).
    reverse
        The same piece in the other direction, (N,).
    against
        Whether the piece leads against a one-way street, (N,) bool.
    first, successors
        Piece i is followed by ``successors[first[i]:first[i + 1]]``; first is (N + 1,).
    """

    starts: Floats
    ends: Floats
    length: Floats
    direction: Floats
    reverse: Ints
    against: NDArray[np.bool_]
    first: Ints
    successors: Ints

    @classmethod
    def from_ways(
        cls, nodes: ArrayLike, ways: Sequence[Sequence[int]],
        one_way: Sequence[int] | None = None,
    ) -> 'RoadMap':
        """
        Return the map of ways that share nodes.

        Parameters
        ----------
        nodes
            Positions in metres, (M, 2).
        ways
            For each way, the indices of its nodes in order. Ways meet where they share a node;
            ways that cross without a shared node do not meet, as on a bridge.
        one_way
            For each way 1 if traffic goes in its order only, -1 if only in the opposite order, and
            0 if it goes both ways; None if all do.

        Raises
        ------
        ValueError
            There is no way of two different places, or an index or a position is not valid.

        """
        raise NotImplementedError

    @classmethod
    def from_polylines(
        cls, polylines: Sequence[ArrayLike], one_way: Sequence[int] | None = None,
    ) -> 'RoadMap':
        """
        Return the map of polylines in metres, each (K, 2), which meet where vertices are equal.

        ``one_way`` and the errors are those of `from_ways`.
        """
        raise NotImplementedError

    def __len__(self) -> int:
        """Return the number of directed pieces."""
        return len(self.length)

    @property
    def total_length(self) -> float:
        """Return the length of the roads in metres, each counted once."""
        return float(self.length.sum()) / 2

    def distance_to(self, x: float, y: float) -> float:
        """Return the distance in metres from a point to the nearest road."""
        raise NotImplementedError
