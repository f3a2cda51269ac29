# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads the roads of an extract of OpenStreetMap, in metres."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.localization.roads import RoadMap
from phase_traj_ros.errors import MapError
from phase_traj_ros.io.maps.limits import check_extent, check_length
from phase_traj_ros.io.maps.osm_pbf import read_pbf
from phase_traj_ros.io.maps.osm_xml import read_xml
from phase_traj_ros.io.maps.projection import LocalProjection
from phase_traj_ros.io.maps.road_classes import OsmWay, Roads

_XML = ('.osm', '.osm.gz', '.osm.bz2')
_PBF = ('.osm.pbf', '.pbf')

# At this distance from the origin, the plane shrinks lengths by 0.1 per thousand. Metres.
_FARTHEST = 100e3
# A map with less road than this, in metres, has none.
_LEAST_ROAD = 1.0

ATTRIBUTION = '© OpenStreetMap contributors, openstreetmap.org/copyright'
"""The attribution that the licence of the data requires."""


@dataclass(frozen=True, eq=False)
class RoadFile:
    """
    The roads of a map, in metres.

    source
        Path of the file, for reports.
    projection
        Projection of the nodes, with its origin at the datum or in the middle of the map.
    nodes
        Positions, (M, 2), in metres, x to the east and y to the north.
    ways
        Indices of the nodes of each road, in order. Roads meet where they share a node.
    one_way
        For each road: 1 if it is one-way in the order of its nodes, -1 against it, 0 otherwise.
    """

    source: str
    projection: LocalProjection
    nodes: NDArray[np.float64]
    ways: tuple[NDArray[np.int64], ...]
    one_way: tuple[int, ...]

    @property
    def lines(self) -> list[NDArray[np.float64]]:
        """Return the centre lines, each (N, 2) with N at least 2, in metres."""
        return [self.nodes[way] for way in self.ways]

    @property
    def length(self) -> float:
        """Return the length of all roads in metres."""
        return sum(float(np.hypot(*np.diff(line, axis=0).T).sum()) for line in self.lines)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Return the bounds in degrees: south, west, north, east."""
        latitude, longitude = self.projection.to_degrees(*self.nodes.T)
        return (
            float(latitude.min()), float(longitude.min()), float(latitude.max()),
            float(longitude.max()))

    @cached_property
    def road_map(self) -> RoadMap:
        """Return the map for the locator."""
        return RoadMap.from_ways(self.nodes, self.ways, self.one_way)


def read_roads(
    path: Path, roads: Roads = Roads.CAR, *, datum: LocalProjection | None = None,
) -> RoadFile:
    """
    Read the roads of an .osm, .osm.gz, .osm.bz2 or .osm.pbf.

    A road that leaves the extract and returns becomes two. The origin is that of ``datum``, or
    the middle of the map if it is None.

    Raises
    ------
    MapError
        The file is missing, truncated, damaged, too large or not a map, has no roads, or is more
        than 100 km from the datum.
    MissingDependencyError
        The map is an .osm.pbf and pyosmium is not installed.

    """
    try:
        if path.name.endswith(_PBF):
            ways = read_pbf(path, roads)
        elif path.name.endswith(_XML):
            ways = read_xml(path, roads)
        else:
            raise MapError(
                f'{path} is not a map: give an extract of OpenStreetMap, .osm.pbf, .osm, .osm.gz'
                ' or .osm.bz2')
    except OSError as error:
        raise MapError(f'{path} cannot be read: {error.strerror or error}') from None
    parts = [part for way in ways for part in _parts(way)]
    if not parts:
        raise _without_roads(path, roads)
    # Each node is projected once, so roads that share it meet exactly.
    _, first, of_point = np.unique(
        np.concatenate([part.nodes for part in parts]), return_index=True, return_inverse=True)
    latitude, longitude = np.concatenate([part.degrees for part in parts])[first].T
    projection = datum or LocalProjection.around(latitude, longitude)
    found = RoadFile(
        str(path), projection, projection.to_metres(latitude, longitude),
        tuple(np.split(of_point, np.cumsum([len(part.nodes) for part in parts])[:-1])),
        tuple(part.one_way for part in parts))
    if datum is not None and not (np.abs(found.nodes) < _FARTHEST).all():
        raise MapError(
            f'{path} is more than {_FARTHEST / 1e3:.0f} km from the datum {datum.latitude:g},'
            f'{datum.longitude:g}: give one on the map')
    check_extent(path, *np.ptp(found.nodes, axis=0).tolist())
    if found.length < _LEAST_ROAD:
        raise _without_roads(path, roads)
    check_length(path, found.length)
    return found


def _without_roads(path: Path, roads: Roads) -> MapError:
    missing, hint = (
        ('roads that a car may drive', ', or take paths as well (--roads all, map_roads: all)')
        if roads is Roads.CAR else ('roads or paths', ''))
    return MapError(f'{path} has no {missing}: give an extract with the key highway{hint}')


def _parts(way: OsmWay) -> Iterator[OsmWay]:
    """
    Yield the parts of a way between nodes that are missing, without repeated nodes.

    A node with a latitude or longitude that does not exist is missing, too.
    """
    latitude, longitude = np.abs(way.degrees).T
    known: NDArray[np.bool_] = (latitude <= 90.0) & (longitude <= 180.0)
    cuts = np.flatnonzero(np.diff(known.astype(np.int8))) + 1
    for part in np.split(np.arange(len(known)), cuts):
        if len(part) and known[part[0]]:
            again = way.nodes[part[1:]] == way.nodes[part[:-1]]
            part = part[np.concatenate([[True], ~again])]
            if len(part) > 1:
                yield OsmWay(way.nodes[part], way.degrees[part], way.one_way)
