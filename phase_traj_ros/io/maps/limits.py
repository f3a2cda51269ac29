# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Limits of the size of a map."""

import math
from pathlib import Path

from phase_traj_ros.errors import MapError

# The locator keeps all roads in memory, and searches all of them.
_MOST_ROAD_M = 10_000e3
# A populated region of this size has more road than that. Degrees of latitude, and metres.
_MOST_DEGREES = 3.0
_FARTHEST_APART_M = 333e3
# A city has fewer than 10 million nodes, a country 50 million or more.
_MOST_NODES = 30_000_000
BYTES_PER_NODE = 8
"""An .osm.pbf has at most this many bytes per node."""


def check_box(path: Path, south: float, west: float, north: float, east: float) -> None:
    """Raise MapError if the region of a map, in degrees, is too large."""
    narrowed = math.cos(math.radians((south + north) / 2))
    if max(north - south, narrowed * (east - west)) > _MOST_DEGREES:
        raise MapError(_too_large(
            path, f'covers {north - south:.1f} by {east - west:.1f} degrees'))


def check_extent(path: Path, east: float, north: float) -> None:
    """Raise MapError if the roads of a map cover too much, in metres."""
    # Not a number, if a node is on the other side of the earth.
    if not max(east, north) <= _FARTHEST_APART_M:
        raise MapError(_too_large(
            path, f'has roads that are more than {_FARTHEST_APART_M / 1e3:.0f} km apart'))


def check_nodes(path: Path, count: int) -> None:
    """Raise MapError if a map has too many nodes."""
    if count > _MOST_NODES:
        raise MapError(_too_large(path, f'has more than {_MOST_NODES // 10**6} million nodes'))


def check_length(path: Path, metres: float) -> None:
    """Raise MapError if a map has too much road."""
    if metres > _MOST_ROAD_M:
        raise MapError(_too_large(path, f'has {metres / 1e3:.0f} km of road'))


def _too_large(path: Path, what: str) -> str:
    return (
        f'{path} {what}, too much to search (at most {_MOST_ROAD_M / 1e3:.0f} km of road): cut out'
        f' the town: osmium extract --bbox WEST,SOUTH,EAST,NORTH {path.name} -o town.osm.pbf')
