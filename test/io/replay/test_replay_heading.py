# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The offline replay where the camera, and perhaps the speed, are known."""

from dataclasses import replace
from functools import lru_cache
import json
import math

import numpy as np
from phase_traj_ros.core import (
    Direction,
    EstimatorSettings,
    Freeman,
    TrajectoryEstimator,
    TravelState,
)
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.errors import ParameterError, SourceError
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.replay.overview import turn_marks
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.results.files import Snapshot
from phase_traj_ros.io.sources.base import Speed, StampedFrame
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import named_drive, render_drive, write_drive_bag
from phase_traj_ros.synthetic.degradations import sensor_noise
from phase_traj_ros.tasks.batch.job import replay_source, ReplayRequest
import pytest
from smaller import THIRD

NARROW = {'code_source': 'heading'}
# The rule of the paper, of whose codes, paths and errors some of these tests are.
PAPER = {'code_source': 'shift'}


@lru_cache
def town():
    return named_drive('demo').build_scene()


@lru_cache
def demo():
    """Return the demo's drive up to the end of its second turn, and its frames."""
    drive = replace(named_drive('demo'), camera=THIRD).take(range(135))
    stamps = drive.stamps_ns.tolist()
    return drive, [StampedFrame(image, stamp) for image, stamp in zip(
        render_drive(drive, scene=town()), stamps)]


@lru_cache
def replayed(**values):
    """Return the replay of these frames; the focal length is known."""
    drive, frames = demo()
    values.setdefault('focal_px', float(drive.camera.focal))
    return replay(frames, Parameters(**values), source='the demo')


def first_turn():
    """Return the drive up to the end of its first turn."""
    drive, _ = demo()
    return drive.take(range(drive.turns[0].end_frame + 1))


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    pytest.importorskip('rosbags')
    path = tmp_path_factory.mktemp('bag') / 'demo'
    write_drive_bag(first_turn(), path, scene=town())
    return path


def along(drive):
    """Return where steps of length 1 along the true heading lead, (n, 2)."""
    yaw = np.unwrap(drive.poses[:, 2])
    middle = (yaw[1:] + yaw[:-1]) / 2 - yaw[0]
    steps = np.stack([np.cos(middle), np.sin(middle)], axis=1)
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def test_the_calibration_stands_in_for_the_focal_length():
    drive, frames = demo()
    height, width = frames[0].image.shape
    camera = CameraModel(
        width=width, height=height, fx=drive.camera.focal, fy=drive.camera.focal,
        cx=(width - 1) / 2, cy=(height - 1) / 2)
    calibrated = replay(frames, Parameters(**NARROW), source='the demo', lens=Lens(camera=camera))
    known = replayed(**NARROW)
    assert calibrated.movement == known.movement
    assert [update.heading for update in calibrated.updates] == [
        update.heading for update in known.updates]
    assert calibrated.camera.focal_px == known.camera.focal_px == pytest.approx(drive.camera.focal)
    # Numbers that are given count before it.
    wrong = replay(
        frames, Parameters(focal_px=float(drive.camera.focal), **NARROW), source='the demo',
        lens=Lens(camera=CameraModel(
            width=width, height=height, fx=9.0, fy=9.0, cx=0.0, cy=0.0)))
    assert wrong.movement == known.movement


@pytest.mark.parametrize('values', [
    NARROW, {'path_from': 'heading', **PAPER}, {'speed': 5.0, **PAPER}])
def test_without_any_word_of_the_camera_it_says_what_to_do(values):
    with pytest.raises(ParameterError, match=r'the demo .*give focal_px or hfov_deg'):
        replay(demo()[1], Parameters(**values), source='the demo')


def test_eight_directions():
    four, eight = replayed(**NARROW), replayed(connectivity=8, **NARROW)
    assert [run.code for run in four.codes.direction.runs] == [
        Direction.FORWARD, Direction.LEFT, Direction.FORWARD]
    assert [run.code for run in eight.codes.direction.runs] == [
        Freeman.FORWARD, Freeman.FORWARD_LEFT, Freeman.LEFT, Freeman.FORWARD_LEFT,
        Freeman.FORWARD]
    assert all(isinstance(code, Freeman) for code in eight.direction)
    steps = np.diff([(update.tip.x, update.tip.y) for update in eight.updates], axis=0)
    lengths = np.hypot(*steps.T)
    assert np.all((lengths < 1e-9) | (abs(lengths - 1) < 1e-9))
    assert len(eight.direction) == len(eight.movement) - eight.movement.count(3)


def test_a_path_from_the_heading_rounds_its_corners():
    drive, _ = demo()
    result = replayed(path_from='heading', **PAPER)
    path = np.array([(0, 0), *((update.tip.x, update.tip.y) for update in result.updates)])
    # The steps are as long as the way, in heights of the camera.
    true = (drive.poses[:, :2] - drive.poses[0, :2]) / drive.camera.above_ground
    assert np.abs(path - true).max() < 0.05 * np.ptp(true, axis=0).max()
    codes = replayed(**PAPER)
    assert codes.movement == result.movement
    assert {update.tip.yaw for update in codes.updates} == {0.0, math.pi / 2}


def test_a_constant_speed_gives_metres():
    drive, _ = demo()
    result = replayed(speed=7.0, **PAPER)
    found = np.array([
        (update.odometry.pose.x, update.odometry.pose.y) for update in result.updates])
    true = 0.7 * along(drive)
    assert np.abs(found - true[1:]).max() < 0.05 * np.ptp(true, axis=0).max()
    assert [update.odometry.speed for update in result.updates] == pytest.approx(
        [7.0] * len(result.updates))
    # The path is still that of the codes, unless it is asked for, too.
    assert {update.tip.yaw for update in result.updates} == {0.0, math.pi / 2}
    drawn = replayed(speed=7.0, path_from='heading', **PAPER)
    assert [(update.tip.x, update.tip.y) for update in drawn.updates] == [
        (update.odometry.pose.x, update.odometry.pose.y) for update in drawn.updates]


def test_speeds_that_come_as_it_drives():
    drive, frames = demo()
    parameters = Parameters(focal_px=float(drive.camera.focal), use_speed_topic=True)
    stamps = [frame.stamp_ns for frame in frames]
    # It drives, stands, reverses, and then nothing more is heard.
    speeds = [
        Speed(stamp, 5.0 if index < 40 else 0.0 if index < 60 else -1.0)
        for index, stamp in enumerate(stamps[:80])]
    result = replay(frames, parameters, source='the demo', speeds=iter(speeds))
    given = [update.odometry for update in result.updates]
    assert given[38].pose.x == pytest.approx(39 * 0.5, rel=0.02)
    assert [each.speed for each in given[40:59]] == [0.0] * 19
    assert given[70].speed == pytest.approx(-1.0)
    # A speed holds for two and a half seconds, which is 25 pairs; then the road goes on, in the
    # metres that it has learned from the speeds.
    states = [update.travel.state for update in result.updates]
    assert set(states[:104]) == {TravelState.GIVEN}
    assert set(states[104:]) == {TravelState.MEASURED}
    speeds_after = np.array([each.speed for each in given[104:]])
    true = np.hypot(*np.diff(drive.poses[104:, :2], axis=0).T) / 0.1
    # The speeds given were 0.6 to 1.1 times the true ones.
    assert 0.6 < (speeds_after / true).min() < (speeds_after / true).max() < 1.1
    # Whatever order they come in, and one from another time does no harm.
    late = replay(
        frames, parameters, source='the demo', speeds=[*speeds[::-1], Speed(10**18, 99.0)])
    assert list(late.updates) == list(result.updates)


@pytest.mark.parametrize(('speeds', 'found'), [
    ([], 'none is valid'),
    ([Speed(10**12, 5.0), Speed(2 * 10**12, 5.0)],
     '2 from 1000.000 to 2000.000 s, images from {first:.3f} to {last:.3f} s')])
def test_speeds_of_another_clock_are_said_to_be_unused(speeds, found):
    drive, frames = demo()
    parameters = Parameters(focal_px=float(drive.camera.focal), use_speed_topic=True)
    result = replay(frames[:11], parameters, source='another clock', speeds=speeds)
    found = found.format(first=frames[0].stamp_ns / 1e9, last=frames[10].stamp_ns / 1e9)
    assert f'no speed for the stamp of an image ({found})' in result.warnings


def test_what_stands_still_does_not_go_on_at_a_constant_speed():
    drive, frames = demo()
    still = [
        StampedFrame(sensor_noise(frames[0].image, sigma=1.0, seed=index), index * 10**8)
        for index in range(30)]
    parameters = Parameters(
        focal_px=float(drive.camera.focal), speed=5.0, still_time=0.5, path_from='heading')
    result = replay(still, parameters, source='a halt')
    stood = [update for update in result.updates if update.status.value == 'still']
    assert len(stood) >= 20
    assert stood[-1].odometry.pose.x == stood[0].odometry.pose.x
    assert stood[-1].odometry.speed == 0.0


def test_a_bag_says_it_all(bag, tmp_path):
    parameters = Parameters(use_speed_topic=True, path_from='heading', connectivity=8, **NARROW)
    out = tmp_path / 'out'
    with open_source(bag) as source:
        result = replay_source(
            source, ReplayRequest(
                source=bag, parameters=parameters, output=out, report=True,
                bag_out=tmp_path / 'out.mcap', bag_debug_images=True))
    drive = first_turn()
    true = drive.poses[:, :2] - drive.poses[0, :2]
    tips = np.array([(update.tip.x, update.tip.y) for update in result.updates])
    assert np.abs(tips - true[1:]).max() < 0.05 * np.ptp(true, axis=0).max()
    code = json.loads((out / 'chain_code.json').read_text())
    assert (code['connectivity'], code['path_from']) == (8, 'heading')
    assert code['focal_px'] == pytest.approx(drive.camera.focal)
    assert 'direction_packed' not in code
    assert set(code['direction']) <= {2, 3, 4}
    last = (out / 'trajectory.tum').read_text().splitlines()[-1].split()
    assert [float(value) for value in last[1:3]] == pytest.approx(tips[-1].tolist(), rel=1e-6)
    with open_source(bag) as source, pytest.raises(SourceError, match=r'no .*on /nowhere.*/speed'):
        replay_source(
            source, ReplayRequest(
                source=bag, parameters=parameters, speed_topic='/nowhere'))


def test_turns_of_the_heading_are_those_in_pictures_and_reports():
    # With eight directions a turn is two changes of the direction, and still one turn.
    drive, _ = demo()
    result = replayed(connectivity=8, **NARROW)
    marks = turn_marks(result)
    assert [mark.angle_deg for mark in marks] == [turn.angle_deg for turn in result.turns]
    assert [mark.side.name for mark in marks] == ['LEFT', 'RIGHT']
    assert sum(code in (0, 2) for code in result.movement) == 4
    for mark, true in zip(marks, drive.turns):
        assert abs(mark.pair - true.start_frame) <= 4 and abs(mark.end_pair - true.end_frame) <= 4


def test_a_turn_that_is_under_way_at_the_end_is_in_the_lists(bag, tmp_path):
    # The first turn alone, cut off before it could be known to have ended.
    parameters = Parameters(focal_px=float(first_turn().camera.focal), **NARROW)
    with open_source(bag) as source:
        result = replay_source(
            source, ReplayRequest(
                source=bag, parameters=parameters, output=tmp_path / 'out'))
    assert not any(update.turns for update in result.updates)
    [turn] = result.turns
    [listed] = json.loads((tmp_path / 'out' / 'chain_code.json').read_text())['turns']
    assert listed['start_frame'] == turn.start_frame
    assert [mark.side.name for mark in turn_marks(result)] == ['LEFT']


@pytest.mark.parametrize('values', [NARROW, {}])
def test_a_camera_that_is_found_to_be_upside_down(values):
    drive, frames = demo()
    parameters = Parameters(focal_px=float(drive.camera.focal), **values)
    estimator = TrajectoryEstimator(parameters.settings)
    turned = parameters.with_values({'rotate_180': True})
    headings = []
    for index, frame in enumerate(frames[:70]):
        if index == 1:
            estimator.reconfigure(turned.settings)
        update = estimator.update(
            np.ascontiguousarray(frame.image[::-1, ::-1]), frame.stamp_ns)
        if update is not None:
            headings.append(math.degrees(update.heading.heading))
    assert headings[-1] == pytest.approx(math.degrees(drive.poses[69, 2]), abs=3)
    assert headings[-1] > 80


def test_a_jump_back_in_time_leaves_nothing_behind():
    drive, frames = demo()
    parameters = Parameters(focal_px=float(drive.camera.focal), **NARROW)
    once = replayed(**NARROW)
    again = replay([*frames[:50], *frames], parameters, source='from the middle')
    assert again.movement == once.movement
    headings = [np.degrees([update.heading.heading for update in each.updates])
                for each in (once, again)]
    assert np.abs(headings[1] - headings[0]).max() < 0.5


def test_frames_that_were_lost_unnoticed():
    # A video whose stamps go on evenly though every fifth frame is missing, in turns, too.
    drive, frames = demo()
    kept = [index for index in range(len(frames)) if index % 5 != 2]
    shown = [
        StampedFrame(frames[index].image, number * 10**8) for number, index in enumerate(kept)]
    parameters = Parameters(focal_px=float(drive.camera.focal), **NARROW)
    result = replay(shown, parameters, source='a video')
    truth = np.degrees(np.unwrap(drive.poses[kept, 2]))[1:]
    found = np.degrees([update.heading.heading for update in result.updates])
    assert np.abs(found - truth).max() < 3.0
    assert not any(update.heading.bridged for update in result.updates)
    assert [code for code in result.movement if code in (0, 2)] == [0, 2]


def test_what_is_saved_says_what_it_is(tmp_path):
    drive, frames = demo()
    parameters = Parameters(focal_px=float(drive.camera.focal), connectivity=8, **NARROW)
    estimator = TrajectoryEstimator(parameters.settings)
    for frame in frames[:60]:
        estimator.update(frame.image, frame.stamp_ns)
    Snapshot.of(estimator, Mounting(Parameters()), source='the demo').write(tmp_path / 'saved')
    saved = json.loads((tmp_path / 'saved' / 'chain_code.json').read_text())
    assert (saved['code_source'], saved['connectivity']) == ('heading', 8)
    assert saved['heading_deg'] == pytest.approx(math.degrees(drive.poses[59, 2]), abs=3)
    assert len(saved['direction_totals']) == 8
    assert sum(saved['direction_totals']) == sum(count for _, count in saved['direction_runs'])


def test_numbers_of_a_camera_that_cannot_be_are_refused():
    with pytest.raises(ParameterError, match='are not consistent: hfov_deg is 170'):
        Parameters(hfov_deg=170.0, lens_straightness=1.3)


def test_a_lens_without_a_use_is_refused():
    with pytest.raises(ValueError, match='requires a lens'):
        TrajectoryEstimator().use_lens(Lens(hfov_deg=80.0))


def test_what_is_no_bag_has_no_speeds(tmp_path, picture):
    import cv2
    for index in range(3):
        cv2.imwrite(str(tmp_path / f'{index}.png'), picture())
    with open_source(tmp_path) as source, pytest.raises(SourceError, match='is not a bag'):
        replay_source(
            source, ReplayRequest(
                source=tmp_path, parameters=Parameters(hfov_deg=80.0, use_speed_topic=True)))


@pytest.mark.parametrize(('values', 'message'), [
    ({'connectivity': 8}, 'requires code_source heading'),
    ({'hfov_deg': 5e-324}, 'give degrees from 0.1'),
    ({'connectivity': 6}, 'give one of 4, 8'),
    ({'speed': 1.0, 'use_speed_topic': True, 'focal_px': 9.0}, 'give one of them'),
])
def test_parameters_that_do_not_go_together(values, message):
    with pytest.raises(ParameterError, match=message):
        Parameters(**values)


@pytest.mark.parametrize(('values', 'message'), [
    ({'speed': math.nan}, 'speed is nan'),
    ({'connectivity': 5}, 'connectivity is 5'),
    ({'connectivity': 8}, 'right angles only'),
    ({'speed': 1.0, 'awaits_speeds': True}, 'give one of them'),
])
def test_settings_that_do_not_go_together(values, message):
    with pytest.raises(ValueError, match=message):
        EstimatorSettings(**values)
