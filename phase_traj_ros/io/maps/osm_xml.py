# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads extracts in the XML of OpenStreetMap, also compressed, with the standard library."""

from array import array
import bz2
from collections.abc import Callable
import gzip
from pathlib import Path
from typing import Any, BinaryIO, Final
from xml.etree import ElementTree
import zlib

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.errors import MapError
from phase_traj_ros.io.maps.limits import check_box, check_nodes
from phase_traj_ros.io.maps.osm_ways import OsmWay
from phase_traj_ros.io.maps.road_classes import is_road, one_way, Roads

_COUNTED = 1 << 16
_OPEN: Final[dict[str, Callable[..., Any]]] = {'.gz': gzip.open, '.bz2': bz2.open}


def read_xml(path: Path, roads: Roads) -> list[OsmWay]:
    """
    Return the roads of an .osm, .osm.gz or .osm.bz2.

    Raises
    ------
    MapError
        The file is truncated, no OpenStreetMap XML, or too large.
    OSError
        The file cannot be read.

    """
    try:
        with _OPEN.get(path.suffix, open)(path, 'rb') as file:
            return _read(path, file, roads)
    except (EOFError, ElementTree.ParseError, zlib.error) as error:
        raise MapError(
            f'{path} is truncated or damaged ({error}): download or cut it again') from None
    except (gzip.BadGzipFile, ValueError, KeyError, OverflowError) as error:
        raise _no_osm(path, error) from None
    except OSError as error:
        # bz2 has no error of its own; those of the operating system have a number.
        if error.errno is not None:
            raise
        raise _no_osm(path, error) from None


def _no_osm(path: Path, error: Exception) -> MapError:
    return MapError(
        f'{path} is not the OpenStreetMap XML that its name says ({error}): give an .osm,'
        ' .osm.gz, .osm.bz2 or .osm.pbf')


def _read(path: Path, file: BinaryIO, roads: Roads) -> list[OsmWay]:
    """Take the elements of a file as they come: first the nodes, then the ways."""
    numbers, places = array('q'), array('d')
    found: list[tuple[list[int], int]] = []
    events = ElementTree.iterparse(file, ('start', 'end'))
    _, root = next(events)
    if root.tag != 'osm':
        raise ValueError(f'it begins with <{root.tag}>')
    for event, element in events:
        if event == 'start' or element.tag in ('nd', 'tag'):
            continue
        if element.tag == 'node':
            numbers.append(int(element.attrib['id']))
            places.extend(float(element.get(key, 'nan')) for key in ('lat', 'lon'))
            if len(numbers) % _COUNTED == 0:
                check_nodes(path, len(numbers))
        elif element.tag == 'way':
            tags = {tag.attrib['k']: tag.attrib['v'] for tag in element.iterfind('tag')}
            if is_road(tags, roads):
                refs = [int(node.attrib['ref']) for node in element.iterfind('nd')]
                found.append((refs, one_way(tags)))
        elif element.tag == 'bounds':
            check_box(path, *(
                float(element.attrib[key]) for key in ('minlat', 'minlon', 'maxlat', 'maxlon')))
        # What has been read would fill the memory.
        root.clear()
    return _placed(found, np.array(numbers), np.array(places).reshape(-1, 2))


def _placed(
    found: list[tuple[list[int], int]], numbers: NDArray[np.int64], places: NDArray[np.float64],
) -> list[OsmWay]:
    """Return roads, given as the numbers of their nodes, with the places of these."""
    order = np.argsort(numbers, kind='stable')
    # The last one, which no node is, stands for those that the extract does not have.
    numbers = np.append(numbers[order], np.iinfo(np.int64).max)
    places = np.append(places[order], [[np.nan, np.nan]], axis=0)
    ways = []
    for refs, direction in found:
        nodes = np.array(refs, np.int64)
        at = np.searchsorted(numbers, nodes)
        known = numbers[at] == nodes
        ways.append(OsmWay(nodes, places[np.where(known, at, -1)], direction))
    return ways
