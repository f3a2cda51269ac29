# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj demo --map``: the check against the truth, and the whole of it."""

from dataclasses import replace
import json

from phase_traj_ros.cli.commands import demo
from phase_traj_ros.cli.commands.demo import distance_off
from phase_traj_ros.cli.main import main
from phase_traj_ros.core.localization.given import OdometryStep
from phase_traj_ros.errors import ResultError
from phase_traj_ros.io.maps.projection import LocalProjection
from phase_traj_ros.io.maps.road_file import read_roads
from phase_traj_ros.io.maps.write_osm import write_osm
from phase_traj_ros.synthetic import town_drive
from phase_traj_ros.tasks.location import run
from phase_traj_ros.tasks.location.motion import Interruption
from phase_traj_ros.tasks.location.odometry import DriveOdometry, IN_METRES
from phase_traj_ros.tasks.location.run import locate
import pytest
from smaller import THIRD
from told_locator import ToldLocator

ORIGIN = LocalProjection(54.5, 7.0)


@pytest.fixture
def made(tmp_path, monkeypatch):
    """Return a function that locates the drive of the demo, from a start so far off the truth."""
    drive = town_drive()
    write_osm(drive.build_roads(), tmp_path / 'town.osm', projection=ORIGIN)
    roads = read_roads(tmp_path / 'town.osm')
    poses = drive.poses[:, :3].tolist()
    odometry = DriveOdometry('town', tuple(drive.stamps_ns.tolist()), tuple(
        (OdometryStep.between(before, after, stamp_ns=stamp),)
        for before, after, stamp in zip(poses, poses[1:], drive.stamps_ns[1:].tolist())),
        IN_METRES)
    x, y = roads.projection.to_metres(*ORIGIN.to_degrees(*poses[0][:2])).tolist()

    def make(off=0.0, odometry=odometry):
        monkeypatch.setattr(
            run, 'MapLocator', lambda *_, **__: ToldLocator((x + off, y, poses[0][2])))
        return locate(odometry, roads)
    return drive, odometry, make


def test_a_wrong_place_is_an_error(made):
    drive, _, make = made

    assert distance_off(make(), drive) < 2.0
    with pytest.raises(ResultError, match=r'a place is [34]\d\.\d m from the true one'):
        distance_off(make(40.0), drive)


def test_no_place_is_an_error(made):
    drive, odometry, make = made
    lost = replace(odometry, motions=(*odometry.motions[:-1], (Interruption(9.0, 1.0),)))

    with pytest.raises(ResultError, match=r'The place is known .* at the end of the drive'):
        distance_off(make(odometry=lost), drive)


def test_a_full_output_is_not_blamed_on_the_folder(tmp_path, capsys, monkeypatch):
    pytest.importorskip('rosbags')
    drive = replace(town_drive(), camera=THIRD)
    monkeypatch.setattr(demo, 'town_drive', lambda: drive.take(range(3)))
    with open('/dev/full', 'w') as full:
        monkeypatch.setattr('sys.stdout', full)
        # The drive is too short to be found.
        assert main(['demo', '--map', '--output', str(tmp_path / 'demo')]) == 2
    assert 'at the end of the drive' in capsys.readouterr().err


@pytest.mark.parametrize('options', [['--paper'], ['--drive', 'paper_case_1']])
def test_options_of_another_drive_are_refused(tmp_path, capsys, options):
    assert main(['demo', '--map', '--output', str(tmp_path / 'demo'), *options]) == 2
    assert 'leave out --drive and --paper' in capsys.readouterr().err


@pytest.mark.integration
def test_the_demo_is_found_on_its_map(tmp_path, capsys, monkeypatch):
    pytest.importorskip('rosbags')
    # Up to well after its place is known.
    drive = replace(town_drive(), camera=THIRD)
    monkeypatch.setattr(demo, 'town_drive', lambda: drive.take(range(360)))
    assert main(['demo', '--map', '--output', str(tmp_path / 'demo')]) == 0

    assert 'The place is known after' in capsys.readouterr().out
    names = {path.name for path in (tmp_path / 'demo').iterdir()}
    assert names >= {'town.osm', 'town_bag', 'location.html', 'location.csv', 'chain_code.json'}
    content = json.loads((tmp_path / 'demo' / 'chain_code.json').read_text())
    assert content['location']['located'] and content['distance_unit'] == 'm'
    assert content['location']['map'] == str(tmp_path / 'demo' / 'town.osm')
