# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The ways of OpenStreetMap that are roads: which they are, and which of them are one-way."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray


class Roads(Enum):
    """Which roads of a map to use."""

    CAR = 'car'
    """Roads that a car may drive."""
    ALL = 'all'
    """Roads and paths, for robots."""


CAR_CLASSES = (
    'motorway', 'motorway_link', 'trunk', 'trunk_link', 'primary', 'primary_link', 'secondary',
    'secondary_link', 'tertiary', 'tertiary_link', 'unclassified', 'residential',
    'living_street', 'service', 'road')
"""Values of the key highway of roads for cars."""

PATH_CLASSES = ('pedestrian', 'track', 'footway', 'bridleway', 'cycleway', 'path', 'busway')
"""Further values of the key highway with ``Roads.ALL``."""

OFF_ROAD = ('parking_aisle', 'driveway', 'drive-through', 'emergency_access')
"""Values of the key service that do not count as roads for cars."""

_CLASSES = {
    Roads.CAR: frozenset(CAR_CLASSES), Roads.ALL: frozenset((*CAR_CLASSES, *PATH_CLASSES))}
# Values that close a road to cars, and the keys that may hold them, most specific first.
_CLOSED = frozenset(('no', 'agricultural', 'forestry', 'emergency'))
_ACCESS = ('motorcar', 'motor_vehicle', 'vehicle', 'access')
_FORWARD = frozenset(('yes', 'true', '1'))
_BACKWARD = frozenset(('-1', 'reverse'))
_ROUND = frozenset(('roundabout', 'circular'))


@dataclass(frozen=True, slots=True, eq=False)
class OsmWay:
    """
    A way of OpenStreetMap that is a road.

    nodes
        Identifiers of its nodes in order, (N,).
    degrees
        Latitude and longitude of the nodes in degrees, (N, 2); NaN for missing nodes.
    one_way
        1 if it is one-way in the order of its nodes, -1 against it, 0 if it is not one-way.
    """

    nodes: NDArray[np.int64]
    degrees: NDArray[np.float64]
    one_way: int


def is_road(tags: Mapping[str, str], roads: Roads) -> bool:
    """Return whether a way with these tags is one of the roads to use."""
    if tags.get('highway') not in _CLASSES[roads] or tags.get('area') == 'yes':
        return False
    if roads is Roads.ALL:
        return True
    if tags.get('service') in OFF_ROAD:
        return False
    access = next((tags[key] for key in _ACCESS if key in tags), 'yes')
    return access not in _CLOSED


def one_way(tags: Mapping[str, str]) -> int:
    """Return 1 if a road is one-way in the order of its nodes, -1 against it, 0 otherwise."""
    value = tags.get('oneway')
    if value in _BACKWARD:
        return -1
    implied = tags.get('junction') in _ROUND or tags.get('highway') == 'motorway'
    return int(value in _FORWARD or (value is None and implied))
