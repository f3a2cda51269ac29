# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is written of a located drive."""

import csv
from dataclasses import replace
import json
import re
from xml.etree import ElementTree

from made_town import drive, PLANE, town_lines, write_town, write_tum
import numpy as np
from phase_traj_ros.core.localization.given import Prior
from phase_traj_ros.errors import MapError
from phase_traj_ros.io.maps.projection import LocalProjection
from phase_traj_ros.io.maps.road_file import read_roads
from phase_traj_ros.io.maps.write_osm import write_osm
from phase_traj_ros.tasks.location import run
from phase_traj_ros.tasks.location.drawing import track_before
from phase_traj_ros.tasks.location.files import write_location
from phase_traj_ros.tasks.location.motion import Interruption
from phase_traj_ros.tasks.location.odometry import read_odometry
from phase_traj_ros.tasks.location.report import verdict
from phase_traj_ros.tasks.location.run import locate, Near, UNKNOWN
import pytest
from told_locator import AFTER, ToldLocator

GPX = '{http://www.topografix.com/GPX/1/1}'


@pytest.fixture
def made(tmp_path, monkeypatch):
    """Return a drive, its odometry and its map; the locator is told the truth."""
    poses = drive()
    roads = read_roads(write_town(tmp_path / 'town.osm'))
    [start] = roads.projection.to_metres(*PLANE.to_degrees([poses[0, 0]], [poses[0, 1]]))
    monkeypatch.setattr(
        run, 'MapLocator', lambda *_, **__: ToldLocator((*start, poses[0, 2])))
    return poses, read_odometry(write_tum(poses, tmp_path / 'drive.tum')), roads


def rows(path):
    with path.open(newline='') as file:
        return list(csv.DictReader(file))


def test_every_pose_has_a_row_and_a_place_from_the_claim_on(made, tmp_path):
    poses, odometry, roads = made
    located = locate(odometry, roads)
    write_location(located, tmp_path, title='drive')

    found = rows(tmp_path / 'location.csv')
    assert len(found) == len(poses)
    assert [row['stamp'] for row in found[:2]] == ['1700000000.000000000', '1700000000.100000000']
    driven = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))])
    latitude, longitude = PLANE.to_degrees(*poses[:, :2].T)
    for number, row in enumerate(found):
        if driven[number] < AFTER - 1.0:
            assert row['latitude'] == row['longitude'] == row['heading_deg'] == ''
            assert row['standard_deviation'] == '' and 0.0 <= float(row['probability']) < 0.99
        elif driven[number] > AFTER + 1.0:
            assert float(row['latitude']) == pytest.approx(latitude[number], abs=2e-5)
            assert float(row['longitude']) == pytest.approx(longitude[number], abs=2e-5)
            off = float(row['heading_deg']) - (90.0 - np.degrees(poses[number, 2]))
            assert abs((off + 180.0) % 360.0 - 180.0) < 0.1
            assert 0.0 <= float(row['heading_deg']) < 360.0
            assert (float(row['probability']), row['standard_deviation']) == (0.995, '2.00')


def test_tracks_have_the_form_that_map_programs_read(made, tmp_path):
    poses, odometry, roads = made
    write_location(locate(odometry, roads), tmp_path, title='drive')

    collection = json.loads((tmp_path / 'track.geojson').read_text())
    assert collection['type'] == 'FeatureCollection'
    assert 'OpenStreetMap contributors' in collection['attribution']
    [feature] = collection['features']
    line = feature['geometry']['coordinates']
    assert feature['geometry']['type'] == 'LineString'
    # GeoJSON has the longitude first.
    assert line[-1] == pytest.approx(
        [float(each) for each in PLANE.to_degrees(*poses[-1, :2])][::-1], abs=2e-5)
    root = ElementTree.parse(tmp_path / 'track.gpx').getroot()
    points = root.findall(f'./{GPX}trk/{GPX}trkseg/{GPX}trkpt')
    assert [(float(each.get('lon')), float(each.get('lat'))) for each in points] == [
        tuple(each) for each in line]
    assert points[-1].find(f'{GPX}time').text.startswith('2023-11-14T22:')


def test_a_source_of_any_name_is_named_in_the_track(made, tmp_path):
    _, odometry, roads = made
    odometry = replace(odometry, source='a\x1b<b>\ud800 \u6771\u200d')
    write_location(locate(odometry, roads), tmp_path, title='')
    name = ElementTree.parse(tmp_path / 'track.gpx').getroot().find(f'./{GPX}trk/{GPX}name')
    assert name.text == 'a_<b>_ \u6771\u200d'


def test_stamps_that_do_not_count_from_1970_are_no_times(made, tmp_path):
    poses, _, roads = made
    odometry = read_odometry(write_tum(poses, tmp_path / 'drive.tum', start=0))
    write_location(locate(odometry, roads), tmp_path, title='drive')

    assert '<time>' not in (tmp_path / 'track.gpx').read_text()
    assert rows(tmp_path / 'location.csv')[1]['stamp'] == '0.100000000'


def test_degrees_have_no_exponents_where_they_are_small(made, tmp_path):
    _, odometry, _ = made
    write_osm(town_lines(), tmp_path / 'null.osm', projection=LocalProjection(0.0, 0.0))
    located = locate(odometry, read_roads(tmp_path / 'null.osm'))
    write_location(located, tmp_path, title='drive')

    assert min(abs(number) for track in located.tracks for pose in track
               for number in located.degrees(pose.estimate)) < 1e-4
    degrees = re.findall(r'l(?:at|on)="([^"]*)"', (tmp_path / 'track.gpx').read_text())
    # As XML Schema has decimal numbers.
    assert degrees and all(re.fullmatch(r'-?\d+\.\d+', each) for each in degrees)


def test_an_interruption_parts_the_track(made, tmp_path):
    _, odometry, roads = made
    middle = len(odometry.motions) // 2
    motions = list(odometry.motions)
    motions[middle] = (Interruption(100.0, 1.0),)
    located = locate(replace(odometry, motions=tuple(motions)), roads)
    write_location(located, tmp_path, title='drive')

    assert located.poses[middle + 1].estimate is UNKNOWN
    features = json.loads((tmp_path / 'track.geojson').read_text())['features']
    assert len(features) == len(located.tracks) == 2
    assert rows(tmp_path / 'location.csv')[middle + 1]['latitude'] == ''


def test_the_key_of_chain_code_json(made, tmp_path):
    _, odometry, roads = made
    located = locate(odometry, roads, near=Near(49.0, 8.4, 2000.0), level=0.9)
    (tmp_path / 'chain_code.json').write_text('{"source": "drive", "frames": 3}')
    write_location(located, tmp_path, title='drive', codes=tmp_path / 'chain_code.json')

    content = json.loads((tmp_path / 'chain_code.json').read_text())
    assert content['frames'] == 3
    told = content['location']
    assert told['located'] and told['level'] == 0.9 and told['near'] == [49.0, 8.4, 2000.0]
    assert told['first_claim']['driven'] == pytest.approx(AFTER, abs=1.0)
    assert told['first_claim']['stamp_ns'] in odometry.stamps_ns
    assert told['last']['latitude'] == pytest.approx(49.0, abs=0.01)
    assert 0.0 < told['claimed_share'] < 1.0
    with pytest.raises(FileNotFoundError, match='gone'):
        write_location(located, tmp_path / 'gone', title='drive')


def test_a_drive_that_is_nowhere_has_candidates_and_no_track(made, tmp_path):
    _, odometry, roads = made
    located = locate(
        replace(odometry, motions=odometry.motions[:200], stamps_ns=odometry.stamps_ns[:201]),
        roads)
    (tmp_path / 'chain_code.json').write_text('{}')
    write_location(located, tmp_path, title='drive', codes=tmp_path / 'chain_code.json')

    told = json.loads((tmp_path / 'chain_code.json').read_text())['location']
    assert not told['located'] and told['first_claim'] is None
    assert 'latitude' not in told['last'] and told['last']['probability'] == 0.3
    assert [each['probability'] for each in told['candidates']] == [0.3, 0.7]
    assert json.loads((tmp_path / 'track.geojson').read_text())['features'] == []
    assert {row['latitude'] for row in rows(tmp_path / 'location.csv')} == {''}
    ElementTree.parse(tmp_path / 'track.gpx')
    page = (tmp_path / 'location.html').read_text()
    assert 'The place is not known' in page and 'class="track"' not in page
    assert 'class="candidate"' in page


def test_the_report_needs_no_server_and_names_the_map(made, tmp_path):
    _, odometry, roads = made
    located = locate(odometry, roads)
    write_location(located, tmp_path, title='a <drive>')

    page = (tmp_path / 'location.html').read_text()
    assert 'a &lt;drive&gt;' in page and verdict(located) in page
    assert re.search(r'The place is known after 30\d m \(\d+ s\)', page)
    assert 'OpenStreetMap contributors' in page and 'Open Database License' in page
    assert not re.search(r'(src|href|url)\s*[=(]', page)
    drawings = re.findall(r'<svg.*?</svg>', page, re.DOTALL)
    for drawing in drawings:
        ElementTree.fromstring(drawing)
    # The track, the curve, and the candidates at four moments.
    assert len(drawings) == 6
    assert 'class="roads"' in drawings[0] and 'class="track"' in drawings[0]
    assert 'class="before"' in drawings[0]
    assert all('class="candidate"' in each for each in drawings[2:])


def test_the_track_to_the_claim_begins_where_the_drive_began(made):
    poses, odometry, roads = made
    track = track_before(locate(odometry, roads))

    start = roads.projection.to_metres(*PLANE.to_degrees(poses[0, 0], poses[0, 1]))
    assert track[0] == pytest.approx(start, abs=0.5)


def test_a_rough_place_becomes_a_prior(made):
    _, _, roads = made
    prior = Near(49.0, 8.4, 500.0).prior(roads)

    assert isinstance(prior, Prior) and prior.radius == 500.0
    assert roads.projection.to_degrees(prior.x, prior.y) == (
        pytest.approx(49.0), pytest.approx(8.4))


@pytest.mark.parametrize(('latitude', 'longitude'), [(-33.9, 18.4), (48.9, 8.4), (-49.0, -171.6)])
def test_the_wrong_continent_is_one_clear_line(made, latitude, longitude):
    _, _, roads = made

    with pytest.raises(MapError, match=r'no road of .* is within 2000 m of .*the map covers') as e:
        Near(latitude, longitude, 2000.0).prior(roads)
    assert '48.99' in str(e.value) and '\n' not in str(e.value)
