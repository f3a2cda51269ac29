# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads extracts in the XML of OpenStreetMap, also compressed, with the standard library."""

from array import array
import bz2
import gzip
from pathlib import Path
from typing import BinaryIO, cast
from xml.parsers import expat
import zlib

import numpy as np
from phase_traj_ros.errors import MapError
from phase_traj_ros.io.maps.limits import check_box, check_nodes
from phase_traj_ros.io.maps.osm_ways import OsmWay
from phase_traj_ros.io.maps.road_classes import is_road, one_way, Roads

_CHUNK = 1 << 20
_COUNTED = 1 << 16


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
    reader = _Reader(path, roads)
    parser = expat.ParserCreate()
    parser.StartElementHandler = reader.start
    parser.EndElementHandler = reader.end
    try:
        with _opened(path) as file:
            while chunk := file.read(_CHUNK):
                parser.Parse(chunk, False)
            parser.Parse(b'', True)
    except (EOFError, expat.ExpatError, zlib.error) as error:
        raise MapError(
            f'{path} is truncated or damaged ({error}): download or cut it again') from None
    except (gzip.BadGzipFile, ValueError, KeyError) as error:
        raise _no_osm(path, error) from None
    except OSError as error:
        # bz2 has no error of its own; those of the operating system have a number.
        if error.errno is not None:
            raise
        raise _no_osm(path, error) from None
    return reader.ways()


def _no_osm(path: Path, error: Exception) -> MapError:
    return MapError(
        f'{path} is not the OpenStreetMap XML that its name says ({error}): give an .osm,'
        ' .osm.gz, .osm.bz2 or .osm.pbf')


def _opened(path: Path) -> BinaryIO:
    if path.suffix == '.gz':
        return cast(BinaryIO, gzip.open(path))
    if path.suffix == '.bz2':
        return cast(BinaryIO, bz2.open(path))
    return path.open('rb')


class _Reader:
    """Takes the elements of a file as they come: first the nodes, then the ways."""

    def __init__(self, path: Path, roads: Roads) -> None:
        self._path = path
        self._roads = roads
        self._started = False
        self._numbers = array('q')
        self._latitudes = array('d')
        self._longitudes = array('d')
        self._tags: dict[str, str] = {}
        self._refs: list[int] | None = None
        self._found: list[tuple[list[int], int]] = []

    def start(self, name: str, attributes: dict[str, str]) -> None:
        """Take the beginning of an element."""
        if name == 'tag':
            if self._refs is not None:
                self._tags[attributes['k']] = attributes['v']
        elif name == 'node':
            self._numbers.append(int(attributes['id']))
            self._latitudes.append(float(attributes.get('lat', 'nan')))
            self._longitudes.append(float(attributes.get('lon', 'nan')))
            if len(self._numbers) % _COUNTED == 0:
                check_nodes(self._path, len(self._numbers))
        elif name == 'nd':
            if self._refs is not None:
                self._refs.append(int(attributes['ref']))
        elif name == 'way':
            self._refs, self._tags = [], {}
        elif name == 'bounds':
            check_box(self._path, *(
                float(attributes[key]) for key in ('minlat', 'minlon', 'maxlat', 'maxlon')))
        elif not self._started and name != 'osm':
            raise ValueError(f'it begins with <{name}>')
        self._started = True

    def end(self, name: str) -> None:
        """Take the end of an element."""
        if name == 'way' and self._refs is not None:
            if is_road(self._tags, self._roads):
                self._found.append((self._refs, one_way(self._tags)))
            self._refs = None

    def ways(self) -> list[OsmWay]:
        """Return the roads with the places of their nodes."""
        numbers = np.array(self._numbers, np.int64)
        places = np.stack([self._latitudes, self._longitudes], axis=-1, dtype=np.float64)
        order = np.argsort(numbers, kind='stable')
        numbers, places = numbers[order], places[order]
        found = []
        for refs, direction in self._found:
            nodes = np.array(refs, np.int64)
            at = np.searchsorted(numbers, nodes).clip(0, max(len(numbers) - 1, 0))
            known = numbers[at] == nodes if len(numbers) else np.zeros(len(nodes), bool)
            where = np.full((len(nodes), 2), np.nan)
            where[known] = places[at[known]]
            found.append(OsmWay(nodes, where, direction))
        return found
