# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The road map: directed pieces of road, and the successors of each."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

#: Largest length of a piece, in metres.
PIECE_M = 5.0
# Nodes closer to the previous one are left out, unless ways meet there: each adds a piece, and
# with it computing time.
_SHORTEST_M = 1.0
# Nodes of a way that are closer are one place, with all ways that meet at either.
_ONE_PLACE_M = 1e-3


@dataclass(frozen=True, eq=False)
class RoadMap:
    """
    Roads as directed pieces of at most 5 m.

    Positions are in metres, x to the east and y to the north. Each piece of road appears twice,
    once per direction. Make a map with ``from_ways`` or ``from_polylines``.

    starts, ends
        Start and end of each piece, (N, 2).
    length, direction
        Length in metres and direction in radians, counter-clockwise from the east, (N,).
    reverse
        Index of the same piece in the opposite direction, (N,).
    against
        Whether the piece leads against a one-way street, (N,).
    first, successors
        The successors of piece i are ``successors[first[i]:first[i + 1]]``; first is (N + 1,).
    """

    starts: Floats
    ends: Floats
    length: Floats
    direction: Floats
    reverse: Ints
    against: Flags
    first: Ints
    successors: Ints

    @classmethod
    def from_ways(
        cls, nodes: ArrayLike, ways: Sequence[ArrayLike],
        one_way: Sequence[int] | None = None,
    ) -> 'RoadMap':
        """
        Return the map of ways, the polylines of roads as in OpenStreetMap, that share nodes.

        Parameters
        ----------
        nodes
            Positions in metres, (M, 2).
        ways
            The indices of the nodes of each way, in order. Ways meet at the nodes that they
            share; ways that cross without a shared node do not meet, as at a bridge.
        one_way
            For each way: 1 if it is one-way in its order, -1 against its order, and 0 if it is not
            one-way; None if none is.

        Raises
        ------
        ValueError
            No way has two different positions, ``one_way`` has another length than ``ways``, an
            index is out of range, or a position is not finite.

        """
        positions = np.asarray(nodes, np.float64).reshape(-1, 2)
        rules = [0] * len(ways) if one_way is None else one_way
        if len(rules) != len(ways):
            raise ValueError(f'one_way has {len(rules)} entries: give one for each of {len(ways)}')
        listed = [np.asarray(way, np.int64) for way in ways]
        every = np.concatenate([np.empty(0, np.int64), *listed])
        if len(every) and not (every.min() >= 0 and every.max() < len(positions)):
            raise ValueError(f'a way names a node that is not among the {len(positions)}')
        if not np.isfinite(positions[every]).all():
            raise ValueError('a position is not finite: give metres')
        place = _places(positions, listed)
        listed = [way[np.diff(way, prepend=-1) != 0] for way in (place[each] for each in listed)]
        shared = np.bincount(
            np.concatenate([every[:0], *listed]), minlength=len(positions)) > 1
        thinned = [_thinned(positions, way, shared) for way in listed]
        edges = [np.stack([way[:-1], way[1:]]) for way in thinned]
        tails, heads = np.concatenate([np.empty((2, 0), np.int64), *edges], axis=1)
        rule = np.repeat(np.asarray(rules, np.int64), [edge.shape[1] for edge in edges])
        real = np.hypot(*(positions[heads] - positions[tails]).T) > 0.0
        if not real.any():
            raise ValueError('the map has no roads: give at least one way of two different places')
        return _pieces(positions, tails[real], heads[real], rule[real])

    @classmethod
    def from_polylines(
        cls, polylines: Sequence[ArrayLike], one_way: Sequence[int] | None = None,
    ) -> 'RoadMap':
        """
        Return the map of polylines in metres, each (K, 2), which meet at equal vertices.

        ``one_way`` and the errors are those of ``from_ways``.
        """
        lines = [np.asarray(line, np.float64).reshape(-1, 2) for line in polylines]
        nodes, index = np.unique(
            np.concatenate([np.empty((0, 2)), *lines]), axis=0, return_inverse=True)
        ends = np.cumsum([len(line) for line in lines])
        return cls.from_ways(nodes, np.split(index.reshape(-1), ends[:-1]), one_way)

    def __len__(self) -> int:
        """Return the number of directed pieces."""
        return len(self.length)

    @cached_property
    def area(self) -> float:
        """Return the area of the bounding box in square metres, at least 1."""
        return float(max(np.ptp(self.starts, axis=0).prod(), 1.0))

    @cached_property
    def origin(self) -> Complexes:
        """Return the start of each piece, x + iy in metres, (N,)."""
        return self.starts[:, 0] + 1j * self.starts[:, 1]

    @cached_property
    def along(self) -> Complexes:
        """Return the unit vector along each piece, x + iy, (N,)."""
        ends = self.ends[:, 0] + 1j * self.ends[:, 1]
        return (ends - self.origin) / self.length

    def positions(self, piece: Ints, offset: Floats) -> Complexes:
        """Return the positions at offsets in metres along pieces, x + iy in metres, (K,)."""
        positions: Complexes = self.origin.take(piece) + offset * self.along.take(piece)
        return positions

    @property
    def middles(self) -> Floats:
        """Return the middle of each piece, (N, 2)."""
        return (self.starts + self.ends) / 2

    def distances_to(self, x: float, y: float) -> Floats:
        """Return the distance in metres from a point to each piece, (N,)."""
        along = self.ends - self.starts
        beyond = np.array([x, y]) - self.starts
        share = np.clip((along * beyond).sum(axis=1) / self.length ** 2, 0.0, 1.0)
        apart: Floats = np.hypot(*(beyond - share[:, None] * along).T)
        return apart

    def distance_to(self, x: float, y: float) -> float:
        """Return the distance in metres from a point to the nearest road."""
        return float(self.distances_to(x, y).min())


def parts_of(counts: Ints) -> tuple[Ints, Ints]:
    """
    Return the owner of each part, and its rank among the parts of that owner, each (K,).

    ``counts`` is the number of parts of each owner, (N,); K is their sum.
    """
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)


def _places(positions: Floats, ways: Sequence[Ints]) -> Ints:
    """Return the place of each node, (M,): the first of the nodes of ways that are one place."""
    tails, heads = np.concatenate(
        [np.empty((2, 0), np.int64), *(np.stack([way[:-1], way[1:]]) for way in ways)], axis=1)
    near = np.hypot(*(positions[heads] - positions[tails]).T) < _ONE_PLACE_M
    tails, heads = tails[near], heads[near]
    place = np.arange(len(positions))
    while (place[tails] != place[heads]).any():
        first = np.minimum(place[tails], place[heads])
        np.minimum.at(place, tails, first)
        np.minimum.at(place, heads, first)
    return place


def _thinned(positions: Floats, way: Ints, shared: Flags) -> Ints:
    """Return a way without the inner nodes that are close to the previous one and not shared."""
    if len(way) < 3:
        return way
    kept = [way[0]]
    for node in way[1:-1]:
        if shared[node] or math.dist(positions[node], positions[kept[-1]]) >= _SHORTEST_M:
            kept.append(node)
    return np.array([*kept, way[-1]])


def _pieces(positions: Floats, tails: Ints, heads: Ints, rule: Ints) -> RoadMap:
    """Return the map of the edges from nodes ``tails`` to ``heads``, cut into pieces."""
    span = positions[heads] - positions[tails]
    parts = np.ceil(np.hypot(*span.T) / PIECE_M).astype(np.int64)
    edge, rank = parts_of(parts)
    starts = positions[tails[edge]] + span[edge] * (rank / parts[edge])[:, None]
    ends = positions[tails[edge]] + span[edge] * ((rank + 1) / parts[edge])[:, None]
    # Points inside an edge are numbered after the nodes.
    inner = len(positions) + np.arange(len(edge))
    entry = np.where(rank == 0, tails[edge], inner - 1)
    leave = np.where(rank == parts[edge] - 1, heads[edge], inner)

    count = len(edge)
    both = np.arange(2 * count)
    starts, ends = np.concatenate([starts, ends]), np.concatenate([ends, starts])
    entry, leave = np.concatenate([entry, leave]), np.concatenate([leave, entry])
    reverse = (both + count) % (2 * count)
    first, successors = _following(entry, leave, reverse)
    # Contiguous, as in ``lens_family._scales``.
    east, north = np.ascontiguousarray((ends - starts).T)
    return RoadMap(
        starts=starts, ends=ends, length=np.hypot(east, north),
        direction=np.arctan2(north, east), reverse=reverse,
        against=np.concatenate([rule[edge] < 0, rule[edge] > 0]),
        first=first, successors=successors)


def _following(entry: Ints, leave: Ints, reverse: Ints) -> tuple[Ints, Ints]:
    """Return the successors in CSR form: the reverse piece only at the end of a road."""
    order = np.argsort(entry, kind='stable')
    points = int(max(entry.max(), leave.max())) + 1
    begin = np.concatenate([[0], np.cumsum(np.bincount(entry, minlength=points))])
    count = (begin[1:] - begin[:-1])[leave]
    owner, rank = parts_of(count)
    successor = order[begin[leave[owner]] + rank]
    kept = (successor != reverse[owner]) | (count[owner] == 1)
    number = np.bincount(owner[kept], minlength=len(entry))
    return np.concatenate([[0], np.cumsum(number)]), successor[kept]
