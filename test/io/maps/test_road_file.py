# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Extracts of OpenStreetMap as lines in metres, and what is wrong with some."""

import bz2
import gzip
from pathlib import Path
import re
import sys

import numpy as np
from phase_traj_ros.errors import MapError, MissingDependencyError
from phase_traj_ros.io.maps.projection import LocalProjection
from phase_traj_ros.io.maps.road_classes import CAR_CLASSES, OFF_ROAD, PATH_CLASSES, Roads
from phase_traj_ros.io.maps.road_file import read_roads
from phase_traj_ros.io.maps.write_osm import write_osm
import pytest

PLANE = LocalProjection(49.0, 8.4)
# A cross of two roads, and a path.
CROSS = [np.array([[-100.0, 0.0], [0.0, 0.0], [100.0, 0.0]]),
         np.array([[0.0, -50.0], [0.0, 0.0], [0.0, 50.0]])]


def osm(ways, *, nodes=((1, 49.0, 8.4), (2, 49.001, 8.4), (3, 49.001, 8.402)), head=''):
    """Return OpenStreetMap XML of ways, each a list of nodes and a dict of tags."""
    text = ['<?xml version="1.0"?>', '<osm version="0.6">', head]
    text += [f'<node id="{i}" lat="{lat}" lon="{lon}"><tag k="highway" v="crossing"/></node>'
             for i, lat, lon in nodes]
    for number, (refs, tags) in enumerate(ways):
        inside = ''.join(f'<nd ref="{ref}"/>' for ref in refs)
        inside += ''.join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())
        text.append(f'<way id="{number}">{inside}</way>')
    return '\n'.join([*text, '</osm>'])


@pytest.fixture
def written(tmp_path):
    """Return a function that writes the text of a map to a file and returns its path."""
    def write(text, name='town.osm'):
        (tmp_path / name).write_text(text)
        return tmp_path / name
    return write


@pytest.fixture
def cross(tmp_path):
    """Return an .osm of two roads that cross, of which the first is one-way."""
    path = tmp_path / 'cross.osm'
    write_osm(CROSS, path, projection=PLANE)
    path.write_text(path.read_text().replace('</way>', '<tag k="oneway" v="yes"/></way>', 1))
    return path


def test_what_is_written_is_read_again(cross):
    found = read_roads(cross)

    assert found.projection.latitude == pytest.approx(PLANE.latitude, abs=1e-8)
    assert found.projection.longitude == pytest.approx(PLANE.longitude, abs=1e-8)
    for line, read in zip(CROSS, found.lines, strict=True):
        assert read == pytest.approx(line, abs=1e-3)
    assert found.one_way == (1, 0)
    assert found.length == pytest.approx(300.0, abs=1e-2)
    # Roads that meet share a node.
    assert found.ways[0][1] == found.ways[1][1]


@pytest.mark.parametrize(('suffix', 'pack'), [('.gz', gzip.compress), ('.bz2', bz2.compress)])
def test_compressed_maps_are_the_same(cross, suffix, pack):
    packed = cross.with_name(f'{cross.name}{suffix}')
    packed.write_bytes(pack(cross.read_bytes()))

    found = read_roads(packed)

    assert [line.tolist() for line in found.lines] == [
        line.tolist() for line in read_roads(cross).lines]


def test_a_pbf_is_the_same(cross):
    pbf = as_pbf(cross)

    found = read_roads(pbf)

    # A .osm.pbf has seven decimals.
    for line, read in zip(read_roads(cross).lines, found.lines, strict=True):
        assert read == pytest.approx(line, abs=0.02)
    assert found.one_way == (1, 0)
    assert found.ways[0][1] == found.ways[1][1]


def as_pbf(path):
    """Return the .osm.pbf of an .osm, written beside it."""
    osmium = pytest.importorskip('osmium')
    pbf = path.with_name('town.osm.pbf')
    writer = osmium.SimpleWriter(str(pbf))
    # pyosmium 3 takes functions of Python only.
    osmium.make_simple_handler(
        node=lambda node: writer.add_node(node), way=lambda way: writer.add_way(way),
    ).apply_file(str(path))
    writer.close()
    return pbf


def test_which_ways_are_roads(written):
    ways = [([1, 2], {'highway': kind}) for kind in (*CAR_CLASSES, *PATH_CLASSES, 'steps')]
    ways += [([1, 2], {'building': 'yes'})]
    ways += [([1, 2], {'highway': 'service', 'service': kind}) for kind in OFF_ROAD]
    ways += [([1, 2], {'highway': 'service', 'access': 'no'}),
             ([1, 2], {'highway': 'residential', 'area': 'yes'})]
    # The most special of the keys counts.
    open_again = ([1, 2], {'highway': 'service', 'access': 'no', 'motor_vehicle': 'yes'})

    path = written(osm([*ways, open_again]))

    assert len(read_roads(path).lines) == len(CAR_CLASSES) + 1
    assert len(read_roads(path, Roads.ALL).lines) == (
        len(CAR_CLASSES) + len(PATH_CLASSES) + len(OFF_ROAD) + 2)


def test_the_table_of_the_docs_is_that_of_the_code():
    page = Path(__file__).resolve().parents[3] / 'docs' / 'reference' / 'maps.md'
    text = page.read_text(encoding='utf-8')
    rows = {
        row[0]: tuple(row[1:]) for line in text.splitlines()
        if line[:2] == '| ' and (row := re.findall('`([^`]+)`', line))}
    assert rows['car'] == CAR_CLASSES
    assert rows['all'] == PATH_CLASSES
    [off_road] = [line for line in text.splitlines() if line.startswith('- ways whose `service`')]
    assert tuple(re.findall('`([^`]+)`', off_road)) == ('service', *OFF_ROAD)


@pytest.mark.parametrize(('tags', 'expected'), [
    ({}, 0),
    ({'oneway': 'no'}, 0),
    ({'oneway': 'yes'}, 1),
    ({'oneway': '-1'}, -1),
    ({'junction': 'roundabout'}, 1),
    ({'highway': 'motorway'}, 1),
    ({'highway': 'motorway', 'oneway': 'no'}, 0),
    ({'oneway': 'alternating'}, 0),
])
def test_one_way_roads(written, tags, expected):
    found = read_roads(written(osm([([1, 2, 3], {'highway': 'residential', **tags})])))

    assert found.one_way == (expected,)


def test_nodes_outside_the_extract_split_a_road(written):
    nodes = [(number, 49.0 + number * 1e-4, 8.4) for number in (1, 2, 4, 5, 7)]
    found = read_roads(written(osm(
        [([1, 2, 3, 4, 5, 6, 7], {'highway': 'primary'})], nodes=nodes)))

    assert [len(line) for line in found.lines] == [2, 2]


@pytest.mark.parametrize('wrong', [(95.0, 8.4), (49.0, 200.0), (1e300, 8.4), ('nan', 8.4)])
def test_a_node_on_no_place_of_the_earth_is_missing(written, wrong):
    nodes = [(1, 49.0, 8.4), (2, 49.001, 8.4), (3, *wrong), (4, 49.002, 8.4), (5, 49.003, 8.4)]
    found = read_roads(written(osm([([1, 2, 3, 4, 5], {'highway': 'primary'})], nodes=nodes)))

    assert [len(line) for line in found.lines] == [2, 2]


@pytest.mark.parametrize('far', [(0.0, 0.0), (-49.0, -171.6), (53.0, 8.4)])
def test_a_road_to_another_country_is_refused(written, far):
    nodes = [(1, 49.0, 8.4), (2, 49.001, 8.4), (3, *far)]
    path = written(osm([([1, 2, 3], {'highway': 'primary'})], nodes=nodes))

    with pytest.raises(MapError, match='more than 333 km apart'):
        read_roads(path)


def test_repeated_nodes_count_once(written):
    found = read_roads(written(osm([([1, 1, 2, 2, 3], {'highway': 'primary'})])))

    assert [len(line) for line in found.lines] == [3]


@pytest.mark.parametrize(('name', 'content', 'message'), [
    ('town.osm', osm([([1, 2], {'building': 'yes'})]).encode(), 'has no roads that a car may'),
    ('town.osm', osm([([8, 9], {'highway': 'primary'})]).encode(), 'has no roads'),
    ('town.osm', osm([([1, 2], {'highway': 'primary'})],
                     nodes=[(1, 49.0, 8.4), (2, 49.0, 8.4)]).encode(), 'has no roads'),
    ('town.osm', osm([([1, 2], {'highway': 'primary'})]).encode()[:-40], 'is truncated'),
    ('town.osm', b'<gpx></gpx>', 'it begins with <gpx>'),
    ('town.osm', b'', 'is truncated'),
    ('town.osm', b'<osm><node id="x"/></osm>', 'is not the OpenStreetMap XML'),
    ('town.osm.gz', gzip.compress(osm([]).encode(), mtime=0)[:-9], 'is truncated'),
    ('town.osm.gz', b'no gzip', 'is not the OpenStreetMap XML that its name says'),
    ('town.osm.bz2', bz2.compress(osm([]).encode())[:-9], 'is truncated'),
    ('town.osm.bz2', b'no bz2 at all', 'is not the OpenStreetMap XML that its name says'),
    ('town.png', b'', 'is not a map: give an extract'),
])
def test_a_bad_map_is_one_clear_line(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)

    with pytest.raises(MapError, match=re.escape(message)) as error:
        read_roads(path)

    assert str(path) in str(error.value) and '\n' not in str(error.value)


@pytest.mark.parametrize(('roads', 'message'), [
    (Roads.CAR, 'no roads that a car may drive: give an extract with the key highway, or take'
     ' paths as well (--roads all, map_roads: all)'),
    (Roads.ALL, 'no roads or paths: give an extract with the key highway'),
])
def test_what_is_missing_fits_the_roads_that_are_asked_for(written, roads, message):
    with pytest.raises(MapError, match=re.escape(message) + '$'):
        read_roads(written(osm([])), roads)


def test_a_missing_map_is_one_clear_line(tmp_path):
    with pytest.raises(MapError, match='No such file'):
        read_roads(tmp_path / 'town.osm')


def test_a_truncated_pbf_is_one_clear_line(cross):
    pbf = as_pbf(cross)
    pbf.write_bytes(pbf.read_bytes()[:-20])

    with pytest.raises(MapError, match=r'is truncated, damaged or no \.osm\.pbf'):
        read_roads(pbf)
    with pytest.raises(MapError, match='No such file'):
        read_roads(cross.with_name('other.osm.pbf'))


def test_a_country_is_refused_with_the_command_that_cuts_it(written):
    bounds = '<bounds minlat="47.2" minlon="5.8" maxlat="55.1" maxlon="15.1"/>'

    with pytest.raises(MapError, match=r'osmium extract --bbox WEST,SOUTH,EAST,NORTH land\.osm'):
        # The nodes are not even read.
        read_roads(written(osm([], head=bounds)[:-10], name='land.osm'))


def test_a_country_without_bounds_is_refused_as_well(written):
    nodes = [(number, 49.0 + number % 2, 8.4) for number in range(200)]

    with pytest.raises(MapError, match='km of road, too much'):
        read_roads(written(osm([(list(range(200)), {'highway': 'primary'})], nodes=nodes)))


def test_a_pbf_without_pyosmium_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, 'osmium', None)

    with pytest.raises(MissingDependencyError, match=r'pip install osmium .*or give the map as'):
        read_roads(tmp_path / 'town.osm.pbf')


def test_the_maps_of_karlsruhe(maps_root):
    pytest.importorskip('osmium')

    found = read_roads(maps_root / 'karlsruhe.osm.pbf')

    assert found.length == pytest.approx(255e3, rel=0.005)
    part = read_roads(maps_root / 'kitti_00_part.osm.bz2')
    assert part.length == pytest.approx(42e3, rel=0.02)
