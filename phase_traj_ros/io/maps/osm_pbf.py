# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads extracts of OpenStreetMap in the PBF format, with pyosmium."""

from importlib import import_module
from pathlib import Path
import sys
from typing import Any

import numpy as np
from phase_traj_ros.errors import MapError, needing
from phase_traj_ros.io.maps.limits import BYTES_PER_NODE, check_box, check_nodes
from phase_traj_ros.io.maps.road_classes import is_road, one_way, OsmWay, Roads


def read_pbf(path: Path, roads: Roads) -> list[OsmWay]:
    """
    Return the roads of an .osm.pbf.

    Raises
    ------
    MapError
        The file is truncated, damaged, too large, or not an .osm.pbf.
    MissingDependencyError
        pyosmium is not installed.

    """
    with needing(
            'maps as .osm.pbf need pyosmium', 'install it for the interpreter that runs this,'
            f' {sys.executable} -m pip install osmium (apt: python3-pyosmium), or give the'
            ' map as .osm, .osm.gz or .osm.bz2'):
        osmium = import_module('osmium')
    check_nodes(path, path.stat().st_size // BYTES_PER_NODE)
    found: list[OsmWay] = []

    def take(way: Any) -> None:
        """Copy a way if it is a road; pyosmium invalidates it after the call."""
        if 'highway' not in way.tags:
            return
        tags = {tag.k: tag.v for tag in way.tags}
        if is_road(tags, roads):
            nodes = np.array([node.ref for node in way.nodes], np.int64)
            places = [node.location for node in way.nodes]
            degrees = np.array([
                (place.lat, place.lon) if place.valid() else (np.nan, np.nan)
                for place in places], np.float64).reshape(-1, 2)
            found.append(OsmWay(nodes, degrees, one_way(tags)))

    try:
        path.open('rb').close()  # osmium reports a missing file as it does a damaged one
        reader = osmium.io.Reader(str(path), osmium.osm.osm_entity_bits.NOTHING)
        box = reader.header().box()
        reader.close()
        if box.valid():
            check_box(
                path, box.bottom_left.lat, box.bottom_left.lon, box.top_right.lat,
                box.top_right.lon)
        osmium.make_simple_handler(way=take).apply_file(str(path), locations=True)
    except RuntimeError as error:
        raise MapError(
            f'{path} is truncated, damaged or no .osm.pbf ({error}): download or cut it again',
        ) from None
    return found
