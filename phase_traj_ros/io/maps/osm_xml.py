# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads extracts of OpenStreetMap in XML, plain or compressed."""

from array import array
import bz2
from collections.abc import Callable
import gzip
from pathlib import Path
from typing import Any, BinaryIO
from xml.etree import ElementTree
import zlib

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.errors import MapError
from phase_traj_ros.io.maps.limits import check_box, check_nodes
from phase_traj_ros.io.maps.road_classes import is_road, one_way, OsmWay, Roads

# The number of nodes is checked each time that this many are read.
_COUNTED = 1 << 16
_OPEN: dict[str, Callable[..., Any]] = {'.gz': gzip.open, '.bz2': bz2.open}


def read_xml(path: Path, roads: Roads) -> list[OsmWay]:
    """
    Return the roads of an .osm, .osm.gz or .osm.bz2.

    Raises
    ------
    MapError
        The file is truncated, damaged, too large, or not OpenStreetMap XML.
    OSError
        The file cannot be read.

    """
    try:
        with _OPEN.get(path.suffix, open)(path, 'rb') as file:
            return _read(path, file, roads)
    except (EOFError, ElementTree.ParseError, zlib.error) as error:
        raise MapError(
            f'{path} is truncated or damaged ({error}): download or cut it again') from None
    except (OSError, ValueError, KeyError, OverflowError) as error:
        # gzip and bz2 raise an OSError without a number for invalid data.
        if isinstance(error, OSError) and error.errno is not None:
            raise
        raise MapError(
            f'{path} is not the OpenStreetMap XML that its name says ({error}): give an .osm,'
            ' .osm.gz, .osm.bz2 or .osm.pbf') from None


def _read(path: Path, file: BinaryIO, roads: Roads) -> list[OsmWay]:
    """Return the roads of a file, in which the nodes precede the ways."""
    identifiers, degrees = array('q'), array('d')
    found: list[tuple[list[int], int]] = []
    events = ElementTree.iterparse(file, ('start', 'end'))
    _, root = next(events)
    if root.tag != 'osm':
        raise ValueError(f'it begins with <{root.tag}>')
    for event, element in events:
        if event == 'start' or element.tag in ('nd', 'tag'):
            continue
        if element.tag == 'node':
            identifiers.append(int(element.attrib['id']))
            degrees.extend(float(element.get(key, 'nan')) for key in ('lat', 'lon'))
            if len(identifiers) % _COUNTED == 0:
                check_nodes(path, len(identifiers))
        elif element.tag == 'way':
            tags = {tag.attrib['k']: tag.attrib['v'] for tag in element.iterfind('tag')}
            if is_road(tags, roads):
                refs = [int(node.attrib['ref']) for node in element.iterfind('nd')]
                found.append((refs, one_way(tags)))
        elif element.tag == 'bounds':
            check_box(path, *(
                float(element.attrib[key]) for key in ('minlat', 'minlon', 'maxlat', 'maxlon')))
        # The root keeps all elements otherwise.
        root.clear()
    return _with_degrees(found, np.array(identifiers), np.array(degrees).reshape(-1, 2))


def _with_degrees(
    found: list[tuple[list[int], int]], identifiers: NDArray[np.int64],
    degrees: NDArray[np.float64],
) -> list[OsmWay]:
    """Return ways, given as node identifiers and direction, with the positions of the nodes."""
    order = np.argsort(identifiers, kind='stable')
    # The last entry is that of the missing nodes.
    identifiers = np.append(identifiers[order], np.iinfo(np.int64).max)
    degrees = np.append(degrees[order], [[np.nan, np.nan]], axis=0)
    ways = []
    for refs, direction in found:
        nodes = np.array(refs, np.int64)
        at = np.searchsorted(identifiers, nodes)
        known = identifiers[at] == nodes
        ways.append(OsmWay(nodes, degrees[np.where(known, at, -1)], direction))
    return ways
