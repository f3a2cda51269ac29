# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The command locate: its inputs, its outputs, and its errors."""

import csv
import json
import os
import subprocess
import sys

import cv2
from made_town import drive, PLANE, write_town, write_tum
import numpy as np
from phase_traj_ros.cli.main import main
from phase_traj_ros.tasks.location import run
import pytest
from told_locator import ToldLocator

GIVEN = ('-p', 'focal_px:=300.0', '-p', 'speed:=5.0', '-p', 'code_source:=shift')
FILES = {'location.csv', 'track.geojson', 'track.gpx', 'location.html'}


@pytest.fixture
def town(tmp_path):
    return write_town(tmp_path / 'town.osm')


@pytest.fixture
def wheels(tmp_path):
    return write_tum(drive(), tmp_path / 'wheels.tum')


@pytest.fixture
def made(monkeypatch):
    """Replace the locator by one that is told the truth; return what each was made with."""
    found = []

    def make(roads, **options):
        found.append(options)
        return ToldLocator(drive()[0], after=options['settings'].claim_above * 300.0)
    monkeypatch.setattr(run, 'MapLocator', make)
    return found


@pytest.fixture
def pictures(tmp_path):
    """Return a folder of pictures whose content moves sideways."""
    folder = tmp_path / 'drive'
    folder.mkdir()
    texture = np.random.default_rng(1).integers(0, 256, (96, 160), dtype=np.uint8)
    for index in range(6):
        cv2.imwrite(
            str(folder / f'{index}.png'),
            cv2.GaussianBlur(np.roll(texture, 5 * index, axis=1), (0, 0), 1.5))
    return folder


def call(*arguments):
    return main(['locate', *map(str, arguments)])


def refused(capsys, *arguments):
    """Run a call that has to fail; return its only line of output."""
    try:
        status = call(*arguments)
    except SystemExit as error:
        status = error.code
    captured = capsys.readouterr()
    assert status == 2 and captured.out == '' and captured.err.count('\n') == 1
    return captured.err


def files_in(folder):
    return {path.name for path in folder.iterdir()}


def test_a_trajectory_on_a_map(made, town, wheels, tmp_path, capsys):
    assert call(wheels, '--map', town, '--output', tmp_path / 'out') == 0

    said = capsys.readouterr().out
    assert 'The place is known after 29' in said and 'at the end: 48.99' in said
    assert '© OpenStreetMap contributors' in said
    assert files_in(tmp_path / 'out') == FILES | {'manifest.json'}
    assert made[0]['prior'] is None and (made[0]['scale'].least, made[0]['scale'].most) == (
        0.9, 1.1)


def test_the_options_reach_the_locator(made, town, wheels):
    assert call(
        wheels, '--map', town, '--near', '49.0,8.4,2km', '--scale', '0.5..3', '--level', '0.9',
        '--roads', 'all') == 0

    [options] = made
    assert options['prior'].radius == 2000.0
    assert (options['scale'].least, options['scale'].most) == (0.5, 3.0)
    assert options['settings'].claim_above == 0.9


def test_a_place_in_the_south_takes_an_equals_sign(made, town, wheels, capsys):
    assert 'no road of' in refused(capsys, wheels, '--map', town, '--near=-33.9,18.4,500m')


def test_the_results_of_a_replay_get_a_key(made, town, pictures, tmp_path, capsys):
    results = tmp_path / 'results'
    assert main(['replay', str(pictures), '--output', str(results), *GIVEN]) == 0
    before = json.loads((results / 'chain_code.json').read_text())
    capsys.readouterr()

    # The drive is short and has no turn.
    assert call(results, '--map', town) == 1

    said = capsys.readouterr().out
    assert 'the drive has no turn' in said and 'at the end: not known' in said
    assert files_in(results) >= FILES | {'chain_code.json', 'shifts.csv'}
    after = json.loads((results / 'chain_code.json').read_text())
    assert after.pop('location')['located'] is False and after == before


@pytest.mark.parametrize('near', [(), ('--near', '49.0,8.4,2km')])
def test_a_short_drive_is_said_to_be_too_short(town, tmp_path, capsys, near):
    # One turn, and 240 m.
    short = write_tum(drive()[:300], tmp_path / 'short.tum')
    assert call(short, '--map', town, *near) == 1
    assert 'too short: give one of about' in capsys.readouterr().out


@pytest.mark.parametrize('recorded', [True, False])
def test_the_results_are_kept_where_nobody_reads(town, pictures, tmp_path, recorded):
    short, output = write_tum(drive()[:300], tmp_path / 'short.tum'), tmp_path / 'out'
    source = [str(pictures), *GIVEN] if recorded else [str(short)]
    reading, writing = os.pipe()
    os.close(reading)
    result = subprocess.run(
        [sys.executable, '-m', 'phase_traj_ros.cli.main', 'locate', *source, '--map', str(town),
         '--output', str(output)],
        stdout=writing, stderr=subprocess.PIPE, text=True, check=False,
        env={**os.environ, 'PYTHONUNBUFFERED': '1'})
    os.close(writing)

    assert result.returncode == 141
    assert result.stderr.endswith('phase_traj: the reader of the output has closed it\n')
    replayed = {'chain_code.json', 'shifts.csv', 'trajectory.png', 'trajectory.tum'}
    assert files_in(output) == FILES | {'manifest.json'} | (replayed if recorded else set())


def test_options_of_a_replay_are_refused_where_nothing_is_replayed(town, wheels, capsys):
    message = refused(
        capsys, wheels, '--map', town, '-p', 'camera_height:=1.5', '--fps', '5', '--one-pass')
    assert 'wheels.tum is not replayed: leave out --fps, --param, --one-pass' in message


def test_a_recording_is_replayed_first(made, town, pictures, tmp_path):
    output = tmp_path / 'out'
    assert call(pictures, '--map', town, '--output', output, *GIVEN) == 1

    assert files_in(output) >= FILES | {'chain_code.json', 'shifts.csv', 'trajectory.tum'}
    content = json.loads((output / 'chain_code.json').read_text())
    assert content['location']['map'] == str(town) and content['frames'] == 6
    with (output / 'location.csv').open() as file:
        assert len(file.readlines()) == 1 + 6
    # A replay into the same folder has no place.
    assert main(['replay', str(pictures), '--output', str(output), *GIVEN]) == 0
    assert not FILES & files_in(output)


def test_no_file_of_someone_else_is_replaced(made, town, wheels, tmp_path, capsys):
    (tmp_path / 'track.gpx').write_text('mine')

    assert 'track.gpx' in refused(capsys, wheels, '--map', town, '--output', tmp_path)
    assert (tmp_path / 'track.gpx').read_text() == 'mine'
    assert call(wheels, '--map', town, '--output', tmp_path, '--force') == 0


def test_a_folder_that_cannot_be_written_is_reported_before_the_search(
        made, town, wheels, capsys):
    # Not even root can make a folder there.
    assert 'cannot write to' in refused(
        capsys, wheels, '--map', town, '--output', '/proc/results')
    assert made == []


def test_without_output_nothing_is_written(made, town, pictures, tmp_path):
    before = files_in(tmp_path)
    assert call(pictures, '--map', town, *GIVEN) == 1

    assert files_in(tmp_path) == before


@pytest.mark.parametrize(('options', 'message'), [
    (('--near', '49.0'), 'give LAT,LON,RADIUS, such as 49.01,8.40,2km'),
    (('--near', '8.4,149.0,x'), 'give LAT,LON,RADIUS'),
    (('--near', '149.0,8.4,2km'), 'is not on the earth'),
    (('--near', '49.0,8.4,0'), 'the radius'),
    (('--near', '10.0,10.0,2km'), 'the map covers latitudes 48.99'),
    (('--scale', '3..0.5'), 'give two positive numbers, such as 0.5..3'),
    (('--scale', 'wide'), 'give two positive numbers'),
    (('--scale', '0.01..100'), 'the larger one up to 10 times the smaller'),
    (('--scale', '1e-300..1e300'), 'the larger one up to 10 times the smaller'),
    (('--scale', '1e-300'), 'give numbers from 0.001 to 1000'),
    (('--level', '1'), 'a probability from 0.5 to below 1'),
    (('--roads', 'sea'), 'invalid choice'),
])
def test_bad_options_are_one_clear_line(made, town, wheels, capsys, options, message):
    assert message in refused(capsys, wheels, '--map', town, *options)


def test_a_bad_map_is_reported_before_the_replay(town, tmp_path, capsys):
    town.write_text('<osm></osm>')
    assert 'has no roads' in refused(capsys, tmp_path / 'absent.mp4', '--map', town)
    town.write_text('<osm>')
    assert 'is truncated' in refused(capsys, tmp_path / 'absent.mp4', '--map', town)


def test_a_drive_without_distances_is_one_clear_line(made, town, pictures, capsys):
    assert 'has no distances' in refused(
        capsys, pictures, '--map', town, '--threshold', '16')


def test_the_place_of_a_drive_through_a_made_town(town, wheels, tmp_path):
    assert call(wheels, '--map', town, '--output', tmp_path / 'out') == 0

    truth = drive()[:, :2]
    with (tmp_path / 'out' / 'location.csv').open(newline='') as file:
        for number, row in enumerate(csv.DictReader(file)):
            if row['latitude']:
                x, y = PLANE.to_metres(float(row['latitude']), float(row['longitude']))
                assert np.hypot(*(truth[number] - (x, y))) < 20.0
    assert row['latitude']
