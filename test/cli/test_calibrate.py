# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera learned from drives, and codes with an unknown camera."""

from dataclasses import replace
import json
import math
import os
import re
import subprocess
import sys

import cv2
import numpy as np
from phase_traj_ros.cli.main import main
from phase_traj_ros.core import CameraEstimate
from phase_traj_ros.io.params_file import read_parameters
from phase_traj_ros.io.results.camera_file import camera_values, write_camera
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import (
    Camera,
    plan_drive,
    render_drive,
    Straight,
    Turn,
    write_drive_bag,
)
import pytest
import yaml

HFOV = 100.0
PLAN = [Straight(1), Turn(90, 3, 4), Straight(1), Turn(-86, 3, 4), Straight(1)]
PITCH = 8.0


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Return bags of two turns at crossings, of the first of them and of none."""
    pytest.importorskip('rosbags')
    drive = plan_drive(
        'two turns', PLAN, rate_hz=10.0, speed=8.0,
        camera=Camera.with_field_of_view(320, 160, HFOV), seed=5)
    folder = tmp_path_factory.mktemp('drives')
    scene = drive.build_scene()
    for name, frames in (('two', len(drive)), ('one', 50), ('none', 9)):
        write_drive_bag(drive.take(range(frames)), folder / name, scene=scene)
    return folder


def found(text):
    """Return the printed parameters."""
    return {name: float(value) for name, value in re.findall(r'parameter: (\w+): (\S+)', text)}


@pytest.mark.parametrize(('drives', 'words'), [
    (['one'], 'learned from 1 part of a turn;'), (['one', 'two'], 'together: '),
    (['none', 'one'], 'none: the camera cannot be learned')])
def test_the_camera_is_learned_from_the_turns(bag, capsys, drives, words):
    assert main(['calibrate', *(str(bag / name) for name in drives)]) == 0
    text = capsys.readouterr().out
    assert words in text
    told = found(text)
    assert told['hfov_deg'] == pytest.approx(HFOV, rel=0.05)
    assert told['lens_straightness'] == pytest.approx(1.0, abs=0.15)
    assert told['lens_offset'] == pytest.approx(0.0, abs=0.03)
    assert abs(told['camera_pitch_deg']) < 3 and abs(told['camera_roll_deg']) < 3
    least, most = map(float, re.findall(r'90 %: ([\d.]+) to ([\d.]+)', text)[-1])
    assert least < 160 / math.tan(math.radians(HFOV / 2)) < most < 1.5 * least


def test_the_file_is_written_where_the_output_is_full(bag, tmp_path):
    path = tmp_path / 'camera.yaml'
    with open('/dev/full', 'w') as full:
        result = subprocess.run(
            [sys.executable, '-m', 'phase_traj_ros.cli.main', 'calibrate', str(bag / 'one'),
             '--output', str(path)],
            stdout=full, stderr=subprocess.PIPE, text=True, check=False,
            env={**os.environ, 'PYTHONUNBUFFERED': '1'})
    assert result.stderr == (
        'phase_traj: error: cannot write to the standard output: No space left on device\n')
    assert 'learned from 1 part of a turn' in path.read_text()


def test_an_output_that_cannot_be_written_is_refused_before_the_work(bag, tmp_path, capsys):
    (tmp_path / 'camera.yaml').mkdir()
    output = ['--output', str(tmp_path / 'camera.yaml')]
    assert main(['calibrate', str(bag / 'absent'), *output]) == 2
    assert 'it is a directory' in capsys.readouterr().err


def test_without_a_turn_nothing_is_written(bag, tmp_path, capsys):
    path = tmp_path / 'camera.yaml'
    assert main(['calibrate', str(bag / 'none'), '--output', str(path)]) == 1
    assert 'give a drive with a turn' in capsys.readouterr().out
    assert not path.exists()


def test_frames_that_cannot_be_used_are_said(tmp_path, capsys):
    for name in ('0.tif', '1.tif'):
        cv2.imwrite(str(tmp_path / name), np.zeros((96, 160), np.float32))
    assert main(['calibrate', str(tmp_path)]) == 2
    assert '0 frames to use, 2 skipped (frame 0: ' in capsys.readouterr().err


@pytest.mark.parametrize('name', ['drive.mp4', 'camera', 'camera.txt'])
def test_a_camera_is_written_to_a_parameter_file_only(tmp_path, capsys, name):
    path = tmp_path / name
    path.write_text('something else')
    assert main(['calibrate', str(tmp_path / 'absent'), '--output', str(path)]) == 2
    assert 'its name has to end in .yaml' in capsys.readouterr().err
    assert path.read_text() == 'something else'


def test_what_was_found_is_printed_before_an_error(bag, tmp_path, capsys):
    assert main(['calibrate', str(bag / 'none'), str(tmp_path / 'missing')]) == 2
    told = capsys.readouterr()
    assert 'none: the camera cannot be learned' in told.out
    assert 'missing does not exist' in told.err


def test_recordings_of_different_cameras_are_refused(bag, tmp_path, capsys):
    drive = plan_drive(
        'tall', PLAN[:3], rate_hz=10.0, speed=8.0,
        camera=Camera.with_field_of_view(240, 240, 80.0), seed=5)
    write_drive_bag(drive, tmp_path / 'tall')
    assert main(['calibrate', str(bag / 'one'), str(tmp_path / 'tall')]) == 2
    assert 'are not of one camera' in capsys.readouterr().err


def test_the_file_goes_to_replay(bag, tmp_path, capsys):
    path = tmp_path / 'new' / 'camera.yaml'
    assert main(['calibrate', str(bag / 'one'), '--output', str(path)]) == 0
    text = capsys.readouterr().out
    assert f'written to {path}' in text
    assert 'learned from 1 part of a turn' in path.read_text()
    parameters = read_parameters(path)
    assert {name: getattr(parameters, name) for name in found(text)} == found(text)
    out = tmp_path / 'out'
    assert main(['replay', str(bag / 'two'), '--params', str(path), '--output', str(out)]) == 0
    code = json.loads((out / 'chain_code.json').read_text())
    assert code['camera']['origin'] == 'parameters'
    assert code['camera']['hfov_deg'] == pytest.approx(found(text)['hfov_deg'], abs=1e-6)
    assert [each for each in code['movement'] if each in (0, 2)] == [0, 2]


@pytest.fixture(scope='module')
def tilted(tmp_path_factory):
    """Return a folder of pictures; the camera is pitched down, its centre is to the left."""
    drive = plan_drive(
        'tilted', PLAN[:4], rate_hz=10.0, speed=8.0,
        camera=Camera.with_field_of_view(360, 160, HFOV), seed=5)
    poses = drive.poses.copy()
    poses[:, 3] = math.radians(PITCH)
    folder = tmp_path_factory.mktemp('tilted')
    for name in ('upright', 'turned'):
        (folder / name).mkdir()
    for index, frame in enumerate(render_drive(replace(drive, poses=poses))):
        seen = np.ascontiguousarray(frame[:, 40:])
        cv2.imwrite(str(folder / 'upright' / f'{index:03}.png'), seen)
        cv2.imwrite(str(folder / 'turned' / f'{index:03}.png'), seen[::-1, ::-1])
    return folder, drive.camera.focal


@pytest.mark.parametrize(('name', 'options'), [('upright', []), ('turned', ['--upside-down'])])
def test_tilt_and_middle_and_the_way_up(tilted, tmp_path, capsys, name, options):
    folder, focal = tilted
    path = tmp_path / 'camera.yaml'
    assert main(['calibrate', str(folder / name), *options, '--output', str(path)]) == 0
    parameters = read_parameters(path)
    assert parameters.rotate_180 == (name == 'turned')
    assert parameters.camera_pitch_deg == pytest.approx(PITCH, abs=2.0)
    # Of 320 columns, the centre of the lens is 20 to the left of that of the image.
    assert parameters.lens_offset == pytest.approx(-20 / 320, abs=0.03)
    assert parameters.settings.lens.focal_for(320) == pytest.approx(focal, rel=0.1)
    out = tmp_path / 'out'
    assert main(
        ['replay', str(folder / name), '--params', str(path), '--output', str(out)]) == 0
    code = json.loads((out / 'chain_code.json').read_text())
    assert code['heading_deg'][-1] == pytest.approx(4.0, abs=4.0)
    assert [each for each in code['movement'] if each in (0, 2)] == [0, 2]


def estimate(**changes):
    return CameraEstimate(**{
        'width': 320, 'height': 240, 'focal_px': 160.0, 'focal_deviation': 0.05, **changes})


@pytest.mark.parametrize('changes', [
    {}, {'straightness': 0.3, 'column_px': 20.0}, {'straightness': -0.4, 'focal_px': 70.0},
    {'column_px': -0.0, 'pitch_deg': 1e-5, 'roll_deg': -1e-9},
    {'column_px': 144.0, 'focal_px': 300.0}, {'straightness': 0.0, 'focal_px': 60.0}])
def test_a_file_says_what_the_drive_has_told(tmp_path, changes):
    told = estimate(pitch_deg=3.0) if not changes else estimate(**changes)
    write_camera(told, tmp_path / 'camera.yaml')
    lens = read_parameters(tmp_path / 'camera.yaml').settings.lens
    assert lens.focal_for(320) == pytest.approx(told.focal_px, rel=1e-3)
    assert lens.straightness == pytest.approx(told.straightness, abs=1e-4)
    assert lens.offset == pytest.approx(told.column_px / 320, abs=1e-4)
    assert lens.pitch_deg == pytest.approx(told.pitch_deg, abs=0.01)


def test_a_lens_too_wide_for_an_angle_keeps_its_focal_length():
    assert 'hfov_deg' not in camera_values(estimate(focal_px=55.0, straightness=0.0))
    assert 'focal_px' not in camera_values(estimate())
    # Values are clamped to the range of the parameter.
    values = camera_values(estimate(pitch_deg=80.0, column_px=200.0))
    assert (values['camera_pitch_deg'], values['lens_offset']) == (60.0, 0.5)
    Parameters(**values)
    assert yaml.safe_load(yaml.safe_dump(values)) == values


@pytest.mark.parametrize('options', [[], ['--one-pass']])
def test_nothing_known_and_nothing_given(bag, tmp_path, options):
    out = tmp_path / 'out'
    assert main(['replay', str(bag / 'one'), *options, '--output', str(out)]) == 0
    code = json.loads((out / 'chain_code.json').read_text())
    # The bag has a calibration.
    assert code['camera']['origin'] == 'calibration'
    assert [each for each in code['movement'] if each in (0, 2)] == [0]
    assert (code['code_source'], code['threshold']) == ('auto', None)
