# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Centre lines of streets, from grids or along a route."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
import math

import numpy as np
import numpy.typing as npt
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.synthetic.arrays import Floats, Ints

#: Distance of the fronts of the houses from the middle of a street, in metres.
HALF_WIDTH = 8.0
#: How far a street extends beyond the end of a route or the last crossing, in metres.
BEYOND = 100.0
#: Length and distance of side streets, in metres.
_SIDE_LENGTH = (60.0, 110.0)
_SIDE_SPACING = (70.0, 150.0)
#: A side street ends where it comes this near to the route again; the route within _OWN of its
#: start does not count. If it would be too short, it is omitted. In metres.
_APART = 24.0
_OWN = 64
_SHORTEST = 40
#: A route that turns by this much within 2 * _BEND metres turns at a crossing.
_SHARP = np.radians(50.0)
_BEND = 16

#: Shorter steps of a route are merged, in metres.
_STILL = 0.4
#: A route that comes this near, in metres, to where it was more than _REVISIT metres before is in
#: the same street again.
_SAME_LANE = 6.0
_REVISIT = 24


@dataclass(frozen=True, eq=False)
class Street:
    """
    A street.

    ``line``: its centre line, (N, 2) in metres, with points about a metre apart; ``again``: it
    repeats another street, so it is kept free and paved, but nothing is built along it.
    """

    line: Floats
    again: bool = False

    @cached_property
    def lengths(self) -> Floats:
        """Return the length of the street up to each point, (N,)."""
        return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.line, axis=0).T))])

    @cached_property
    def _courses(self) -> Floats:
        """Return x, y and the direction of travel (dx, dy) at each point, (4, N)."""
        return np.concatenate([self.line, np.gradient(self.line, axis=0)], axis=1).T.copy()

    def beside(self, along: Floats, left: Floats | float) -> Floats:
        """Return the points (M, 2) at ``along`` (M,), ``left`` metres left of the centre."""
        (x, y, dx, dy) = (np.interp(along, self.lengths, values) for values in self._courses)
        scale = left / np.maximum(np.hypot(dx, dy), 1e-9)
        return np.stack([x - dy * scale, y + dx * scale], axis=1)


def evenly(points: npt.ArrayLike) -> Floats:
    """Return a line through the points (N, 2), resampled to about a metre between points."""
    given = np.asarray(points, np.float64).reshape(-1, 2)
    if not len(given) or not np.isfinite(given).all():
        raise ParameterError('a route needs at least one point, and finite numbers only')
    # A vehicle at rest has no direction; steps below _STILL are skipped.
    places = given.tolist()
    kept = places[:1]
    for (x, y) in places[1:]:
        if math.hypot(x - kept[-1][0], y - kept[-1][1]) > _STILL:
            kept.append([x, y])
    if len(kept) < 2:
        kept.append([kept[0][0] + 1.0, kept[0][1]])
    line = np.array(kept)
    along = Street(line).lengths
    evenly_along = np.linspace(0.0, along[-1], max(round(along[-1]), 1) + 1)
    return np.stack([np.interp(evenly_along, along, values) for values in line.T], axis=1)


def grid_streets(xs: Sequence[float], ys: Sequence[float]) -> tuple[Street, ...]:
    """
    Return the streets of a grid.

    One street runs north and south at each of ``xs``, one east and west at each of ``ys``, in
    metres. All extend beyond the outermost crossings.
    """
    if not (len(xs) and len(ys)):
        raise ParameterError('a street grid needs at least one street in each direction')
    return tuple(Street(evenly(road[[0, -1]])) for road in grid_roads(xs, ys))


def grid_roads(xs: Sequence[float], ys: Sequence[float]) -> list[Floats]:
    """Return the streets of a grid as centre lines (N, 2) that share their crossings."""
    west_to_east = [min(xs) - BEYOND, *sorted(xs), max(xs) + BEYOND]
    south_to_north = [min(ys) - BEYOND, *sorted(ys), max(ys) + BEYOND]
    return [
        *(np.array([(x, y) for x in west_to_east]) for y in ys),
        *(np.array([(x, y) for y in south_to_north]) for x in xs)]


def unit(direction: Floats) -> Floats:
    """Return a direction (x, y) with length 1; one without length stays 0."""
    return direction / max(float(np.hypot(*direction)), 1e-9)


def left_of(direction: Floats) -> Floats:
    """Return a direction (x, y) turned by 90 degrees to the left."""
    return np.array([-direction[1], direction[0]])


def _ray(start: Floats, direction: Floats, length: float) -> Floats:
    return evenly([start, start + length * unit(direction)])


def _straight_on(route: Floats) -> Floats:
    """Continue the route at both of its ends."""
    back = _ray(route[0], route[0] - route[min(8, len(route) - 1)], BEYOND / 4)
    on = _ray(route[-1], route[-1] - route[max(len(route) - 9, 0)], BEYOND)
    return np.concatenate([back[:0:-1], route, on[1:]])


def _corners(route: Floats) -> Ints:
    """Return the sharp turns of a route, one index for each."""
    ahead = np.gradient(route, axis=0)
    heading = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    if len(heading) <= 2 * _BEND:
        return np.zeros(0, np.int64)
    change = np.abs(heading[2 * _BEND:] - heading[:-2 * _BEND])
    corners: list[int] = []
    for index in np.flatnonzero(change > _SHARP).tolist():
        sharpest = change[max(index - _BEND, 0):index + _BEND + 1].max()
        if change[index] >= sharpest and not (corners and index - corners[-1] < _BEND):
            corners.append(index)
    return np.array(corners, np.int64) + _BEND


def _side(route: Floats, root: int, start: Floats, direction: Floats, length: float) -> Street:
    """Return a side street that ends before it meets the route again, away from its start."""
    line = _ray(start, direction, length)
    around = route[np.hypot(*(route - start).T) < length + _APART]
    own = route[max(root - _OWN, 0):root + _OWN + 1]
    # Other passes through the same street do not count either.
    elsewhere = around[_distances(around, own) > _SAME_LANE]
    if len(elsewhere):
        meets = np.flatnonzero(_distances(line, elsewhere) < _APART)
        line = line[:meets[0]] if len(meets) else line
    return Street(line)


def _distances(points: Floats, line: Floats) -> Floats:
    """Return the distance of each of the points (N, 2) from the nearest of ``line`` (M, 2)."""
    (dx, dy) = (points[:, None, :] - line[None, :, :]).transpose(2, 0, 1)
    distances: Floats = np.sqrt((dx * dx + dy * dy).min(axis=1))
    return distances


def _pieces(route: Floats) -> list[Street]:
    """Split a route into new pieces and pieces that repeat earlier ones."""
    been = np.zeros(len(route), bool)
    for index in range(_REVISIT, len(route)):
        (dx, dy) = (route[:index - _REVISIT + 1] - route[index]).T
        been[index] = (dx * dx + dy * dy).min() < _SAME_LANE ** 2
    edges = np.flatnonzero(np.diff(been)) + 1
    pieces = []
    for (first, last) in zip([0, *edges], [*edges, len(route)]):
        # Neighbouring pieces share a point.
        line = route[first:last + 1]
        if len(line) > 1:
            pieces.append(Street(line, again=bool(been[first]) or len(line) < _REVISIT // 2))
    return pieces


def streets_along(points: npt.ArrayLike, rng: np.random.Generator) -> tuple[Street, ...]:
    """
    Return the street that follows a route (N, 2), in metres, and streets off it.

    At a sharp turn of the route, the streets it leaves and enters continue straight ahead. Side
    streets leave it at random places. Where the route repeats itself, there is only one street.
    """
    route = evenly(points)
    sides: list[Street] = []
    for corner in _corners(route).tolist():
        (before, after) = (max(corner - _BEND, 0), min(corner + _BEND, len(route) - 1))
        into = route[before] - route[max(before - 6, 0)]
        out = route[min(after + 6, len(route) - 1)] - route[after]
        for (start, direction) in ((route[before], into), (route[after], -out)):
            length = 2 * _BEND + rng.uniform(*_SIDE_LENGTH)
            sides.append(_side(route, corner, start, direction, length))
    place = rng.uniform(0.2, 0.6) * _SIDE_SPACING[1]
    while place < len(route) - 1:
        index = int(place)
        left = left_of(route[index + 1] - route[index])
        for side in (-1.0, 1.0):
            if rng.random() < 0.6:
                sides.append(_side(
                    route, index, route[index], side * left, rng.uniform(*_SIDE_LENGTH)))
        place += rng.uniform(*_SIDE_SPACING)
    return (*_pieces(_straight_on(route)), *(side for side in sides if len(side.line) > _SHORTEST))
