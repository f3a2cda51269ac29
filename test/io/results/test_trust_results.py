# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Files, figures, the console and diagnostics report whether a result is reliable."""

import json

import cv2
import numpy as np
import overlays
from phase_traj_ros.cli.main import main
from phase_traj_ros.core import TrajectoryEstimator
from phase_traj_ros.io.messages.diagnostics import Level, MeasurementReporter
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.results.files import Snapshot
from phase_traj_ros.io.results.palette import bgr, DARK
from phase_traj_ros.io.results.pictures import draw, LeftOutPicture, shade
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
from phase_traj_ros.synthetic.degradations import sensor_noise
import pytest
from rolled import rolled_frames, TEXTURE

AUTO = Parameters(code_source='auto', hfov_deg=70.0)
SHIFT = Parameters(code_source='shift')


def drive_of(seed, *plan):
    return list(render_drive(plan_drive(
        'a drive', list(plan), rate_hz=10.0, speed=6.0, seed=seed,
        camera=Camera.with_field_of_view(320, 240, 70.0))))


@pytest.fixture(scope='module')
def barred():
    """Return a video of two scenes with black bars; the second scene begins with frame 30."""
    scenes = [*drive_of(8, Straight(3.0))[:30], *drive_of(3, Straight(0.5), Turn(90.0, 3.0, 4.5))]
    return [overlays.black_bars(frame, sides=0.15) for frame in scenes]


def noise(count=30):
    rng = np.random.default_rng(0)
    return [rng.integers(0, 255, (96, 160), np.uint8) for _ in range(count)]


def stamped(images):
    return [StampedFrame(each, index * 10**8) for index, each in enumerate(images)]


def write(folder, images):
    folder.mkdir()
    for index, each in enumerate(images):
        cv2.imwrite(str(folder / f'{index:04}.png'), each)
    return str(folder)


def followed(images, parameters):
    estimator = TrajectoryEstimator(parameters.settings)
    updates = [estimator.update(each, index * 10**8) for index, each in enumerate(images)]
    return estimator, updates[-1]


def test_replay_prints_and_writes_the_reasons(tmp_path, capsys):
    source, output = write(tmp_path / 'noise', noise()), tmp_path / 'out'
    assert main([
        'replay', source, '--output', str(output), '--report', '-p', 'code_source:=shift']) == 0
    [line] = [
        line for line in capsys.readouterr().out.splitlines() if line.startswith('not reliable')]
    assert line.startswith('not reliable: The parts of the image do not move as seen from one')
    content = json.loads((output / 'chain_code.json').read_text())
    assert (content['reliable'], content['reasons']) == (False, ['not_one_motion'])
    page = (output / 'report.html').read_text()
    assert '<dt>reliable</dt><dd>no</dd>' in page
    assert '<p class="warn">The parts of the image' in page


def test_scenes_and_fixed_areas_are_in_files_and_report(tmp_path, barred, capsys):
    source, output = write(tmp_path / 'film', barred), tmp_path / 'out'
    assert main([
        'replay', source, '--output', str(output), '--report', '-p', 'code_source:=auto',
        '-p', 'hfov_deg:=70.0']) == 0
    assert 'not reliable' not in capsys.readouterr().out
    content = json.loads((output / 'chain_code.json').read_text())
    assert (content['reliable'], content['reasons'], content['cuts']) == (True, [], [30])
    assert len(content['heading_deg']) == len(barred)
    page = (output / 'report.html').read_text()
    assert '<dt>reliable</dt><dd>yes</dd>' in page
    assert 'New scenes start at the frames 30.' in page
    assert 'alt="Fixed areas" src="data:image/jpeg' in page


def test_fixed_areas_are_shaded(barred):
    watcher = LeftOutPicture(width=160)
    replay(stamped(barred), AUTO, source='', watchers=[watcher])
    picture = cv2.imdecode(np.frombuffer(watcher.jpeg, np.uint8), cv2.IMREAD_COLOR)
    shaded = np.array(bgr(DARK.warn)) / 2
    assert np.abs(picture[:, :18] - shaded).mean() < 15
    assert np.ptp(picture[30:90, 60:100].astype(int), axis=2).mean() < 10
    watcher = LeftOutPicture()
    replay(rolled_frames(), SHIFT, source='', watchers=[watcher])
    assert watcher.jpeg is None


def test_the_debug_picture_shades_it_too(barred):
    estimator, update = followed(barred, AUTO)
    picture = draw(StampedFrame(barred[-1], 0), update, estimator)
    assert np.abs(picture[100:150, :36] - np.array(bgr(DARK.warn)) / 2).mean() < 15
    clear = np.zeros((4, 6, 3), np.uint8)
    corner = np.full((4, 6), 255, np.uint8)
    corner[0, 0] = 0
    shade(clear, corner)
    assert np.flatnonzero(clear.any(axis=2)).tolist() == [0]


def test_a_snapshot_and_the_diagnostics_contain_it(tmp_path):
    for images, reliable in ((noise(), False), (
            [sensor_noise(TEXTURE, sigma=1.0, seed=index) for index in range(30)], True)):
        estimator, _ = followed(images, SHIFT)
        folder = tmp_path / str(reliable)
        Snapshot.of(estimator, Mounting(Parameters()), source='').write(folder)
        content = json.loads((folder / 'chain_code.json').read_text())
        assert content['reliable'] is reliable and bool(content['reasons']) is not reliable
        report = MeasurementReporter().report(estimator, 0.1)
        assert report.values['reliable'] == str(reliable).lower()
        assert report.values['reasons'] == ' '.join(content['reasons'])
        assert report.level is (Level.OK if reliable else Level.WARN)
        assert reliable or report.message.startswith('The parts of the image do not move')


def test_there_is_no_warning_before_the_first_pairs():
    estimator = TrajectoryEstimator(SHIFT.settings)
    assert MeasurementReporter().report(estimator, 0.0).level is Level.OK
    for index, each in enumerate(noise(4)):
        estimator.update(each, index * 10**8)
    report = MeasurementReporter().report(estimator, 0.0)
    assert (report.level, report.values['reasons']) == (Level.OK, 'too_short')


def test_the_hint_is_printed_under_the_paper_s_rule(tmp_path, capsys):
    rolls = np.cumsum([0] * 30 + [14] * 10 + [0] * 30)
    source = write(tmp_path / 'drive', [
        sensor_noise(np.roll(TEXTURE, roll, axis=1), sigma=1.0, seed=index)
        for index, roll in enumerate(rolls)])
    assert main(['replay', source, '-p', 'code_source:=shift']) == 0
    assert ('hint: no lasting shift reached the threshold of 16 px, the largest was 14 px: if the'
            ' vehicle turned, try code_source auto, or a threshold of about 7 px'
            ) in capsys.readouterr().out
    assert main(['replay', source, '-p', 'threshold:=7.0']) == 0
    assert 'hint:' not in capsys.readouterr().out
