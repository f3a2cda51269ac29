# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Odometry for the locator: from replays, their results, and trajectories."""

from dataclasses import replace
import math

from made_town import drive, write_tum
import numpy as np
from phase_traj_ros.core import LinkCode, PairStatus, Travel, TravelState
from phase_traj_ros.core.codes.text import describe_links
from phase_traj_ros.core.localization.given import OdometryStep
from phase_traj_ros.errors import ResultError, SourceError
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.results.files import write_chain_code, write_shifts
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.tasks.location.motion import Interruption, Motions, MovedPair
from phase_traj_ros.tasks.location.odometry import (
    IN_HEIGHTS,
    IN_METRES,
    odometry_of,
    read_odometry,
)
import pytest
from rolled import rolled_frames

GIVEN = {'focal_px': 300.0, 'speed': 5.0, 'code_source': 'shift'}
SECOND = 1_000_000_000


@pytest.fixture(scope='module')
def result():
    return replay(rolled_frames(), Parameters(**GIVEN), source='a drive')


@pytest.fixture
def results(result, tmp_path):
    """Return the folder of the results of a replay."""
    write_chain_code(result, tmp_path / 'chain_code.json')
    write_shifts(result, tmp_path / 'shifts.csv')
    return tmp_path


def pair(number=0, **values):
    return MovedPair(**{
        'stamp_ns': number * SECOND // 10, 'interval_ns': SECOND // 10, 'status': PairStatus.OK,
        'distance': 1.0, 'distance_variance': 0.01, 'yaw': 0.1, 'yaw_variance': 1e-4, **values})


def test_a_replay_and_its_results_are_the_same_odometry(result, results):
    live, read = odometry_of(result), read_odometry(results)

    assert live.source == read.source and live.stamps_ns == read.stamps_ns
    assert len(live.motions) == len(live.stamps_ns) - 1
    assert live.scale == read.scale == IN_METRES
    for one, other in zip(live.steps, read.steps, strict=True):
        assert one.stamp_ns == other.stamp_ns
        assert other.distance == pytest.approx(one.distance, abs=1e-5)
        assert other.distance_variance == pytest.approx(one.distance_variance, rel=1e-3)
        assert other.yaw == pytest.approx(one.yaw, abs=math.radians(1e-4))
        assert other.yaw_variance == pytest.approx(one.yaw_variance, rel=1e-3)
    assert any(step.yaw_variance > 0.0 for step in live.steps)


def test_camera_heights_have_a_wide_scale(result):
    heights = replace(result, mounting=Mounting(Parameters(focal_px=300.0, code_source='auto')))

    assert odometry_of(heights).scale == IN_HEIGHTS


def test_a_replay_without_distances_says_what_to_do(result, results):
    with pytest.raises(SourceError, match='a drive has no distances to be located by: replay'):
        odometry_of(replay(rolled_frames(), Parameters(threshold=16.0), source='a drive'))
    write_chain_code(
        replay(rolled_frames(), Parameters(threshold=16.0), source='a drive'),
        results / 'chain_code.json')
    with pytest.raises(ResultError, match='has no distances'):
        read_odometry(results)


@pytest.mark.parametrize(('name', 'content'), [
    ('chain_code.json', None), ('shifts.csv', None), ('chain_code.json', '[]'),
    ('chain_code.json', 'x'), ('shifts.csv', 'pair,stamp\n0,x\n')])
def test_what_is_no_replay_says_so(results, name, content):
    if content is None:
        (results / name).unlink()
    else:
        (results / name).write_text(content)

    with pytest.raises(ResultError, match=r'does not hold .*: replay'):
        read_odometry(results)


def test_a_gap_a_cut_and_a_lost_pair():
    motions = Motions()
    [first] = motions.of(pair())
    [cut] = motions.of(pair(1, cut=True))
    [gap] = motions.of(pair(2, status=PairStatus.GAP, interval_ns=4 * SECOND))
    [long_gap] = motions.of(pair(3, status=PairStatus.GAP, interval_ns=60 * SECOND))

    assert isinstance(first, OdometryStep) and first.distance == 1.0
    assert cut == Interruption(math.inf, math.pi)
    assert isinstance(gap, Interruption) and 0.0 < gap.distance < long_gap.distance
    assert gap.turn < long_gap.turn == math.pi


def test_an_unknown_distance_is_bridged_for_seconds():
    motions = Motions()
    motions.of(pair())
    bridged = [motions.of(pair(number, distance=None)) for number in range(1, 4)]
    after = motions.of(pair(4))

    # The vehicle went on with 10 m/s, more or less; its yaw is known.
    for [step] in bridged:
        assert step.distance == pytest.approx(1.0) and step.yaw == 0.1
    # The speed is off by a half, for all three pairs alike.
    assert sum(step.distance_variance for [step] in bridged) == pytest.approx(1.5 ** 2)
    assert len(after) == 1
    unknown = [motions.of(pair(number, distance=None)) for number in range(5, 150)]
    lost = [each for each, *step in unknown if step]
    # Every five seconds, so that a place is not told for longer.
    assert len(lost) == 2 and all(each.turn == 0.0 and each.distance >= 50.0 for each in lost)
    # What an interruption covers is not added to it.
    assert [step[0].distance for _, *step in unknown if step] == [0.0, 0.0]
    [step] = motions.of(pair(150))
    assert step.distance == 1.0


def test_a_vehicle_that_stood_may_have_pulled_off():
    motions = Motions()
    motions.of(pair(distance=0.0))
    bridged = [motions.of(pair(number, distance=None))[0] for number in range(1, 31)]

    assert all(step.distance == 0.0 for step in bridged)
    # A car makes 9 m in 3 s.
    assert math.sqrt(sum(step.distance_variance for step in bridged)) == pytest.approx(6.0)


@pytest.mark.parametrize('interrupted', [
    {'status': PairStatus.GAP, 'interval_ns': SECOND}, {'cut': True}])
def test_after_an_interruption_a_distance_is_bridged_anew(interrupted):
    motions = Motions()
    motions.of(pair())
    first = motions.of(pair(1, distance=None))
    for number in range(2, 40):
        motions.of(pair(number, distance=None))
    motions.of(pair(40, **interrupted))
    after = motions.of(pair(41, distance=None))

    assert after[0].distance_variance == pytest.approx(first[0].distance_variance)


def test_a_distance_that_is_not_measured_is_none(result, results):
    bridged = Travel(1.0, 0.01, TravelState.BRIDGED)
    assert MovedPair.of(replace(result.updates[0], travel=bridged)).distance is None
    updates = [replace(each, travel=bridged) for each in result.updates]
    write_shifts(replace(result, updates=updates), results / 'shifts.csv')
    last = read_odometry(results).steps[-1]
    assert last.distance == 0.0


def test_an_update_without_heading_or_distance_is_no_pair(result):
    update = result.updates[0]
    unknown = replace(update, travel=Travel(1.0, 1.0, TravelState.UNKNOWN))
    gap = replace(update, status=PairStatus.GAP, cut=True)

    assert MovedPair.of(replace(update, heading=None)) is None
    assert MovedPair.of(replace(update, travel=None)) is None
    assert MovedPair.of(unknown).distance is None
    assert MovedPair.of(gap).status is PairStatus.GAP and MovedPair.of(gap).cut


def test_a_trajectory_is_metres(tmp_path):
    poses = drive()
    odometry = read_odometry(write_tum(poses, tmp_path / 'wheels.tum'))

    steps = odometry.steps
    assert len(odometry.stamps_ns) == len(poses) == len(steps) + 1
    assert odometry.stamps_ns[0] == 1_700_000_000 * SECOND
    assert odometry.scale == IN_METRES and not odometry.straight
    assert sum(step.distance for step in steps) == pytest.approx(
        np.hypot(*np.diff(poses[:, :2], axis=0).T).sum(), abs=0.01)
    assert sum(step.yaw for step in steps) == pytest.approx(poses[-1, 2] - poses[0, 2], abs=1e-4)


def test_a_drive_without_a_turn_is_straight(tmp_path):
    poses = np.column_stack([np.arange(50.0), np.zeros(50), np.zeros(50)])

    assert read_odometry(write_tum(poses, tmp_path / 'straight.tum')).straight


@pytest.mark.parametrize(('seconds', 'farthest'), [(20.0, 500.0), (1.0, 200.0)])
def test_missing_poses_interrupt_a_trajectory(tmp_path, seconds, farthest):
    # What happens between poses that are 200 m apart is not known; 26 m are a pose per 2 s.
    poses = drive(step=26.0)
    near = read_odometry(write_tum(poses, tmp_path / 'near.tum', interval=2.0))
    assert all(isinstance(each, OdometryStep) for [each] in near.motions)
    straight = np.column_stack([[0.0, 50.0, 250.0, 300.0], np.zeros((4, 2))])
    far = read_odometry(write_tum(straight, tmp_path / 'far.tum', interval=seconds))
    [_], [missing], [_] = far.motions
    assert isinstance(missing, Interruption) and len(far.steps) == 2
    assert missing.distance == pytest.approx(farthest)
    assert missing.turn == (math.pi if seconds > 10.0 else 0.5)


@pytest.mark.parametrize('turned', [math.pi, math.pi / 2])
def test_poses_that_do_not_face_where_they_move_are_refused(tmp_path, turned):
    poses = drive()
    with pytest.raises(SourceError, match='poses that do not face where they move: give'):
        read_odometry(write_tum(poses + np.array([0.0, 0.0, turned]), tmp_path / 'turned.tum'))
    poses[:, 2] = 0.0
    with pytest.raises(SourceError, match='poses that do not face where they move: give'):
        read_odometry(write_tum(poses, tmp_path / 'constant.tum'))


def test_the_noise_of_positions_is_no_motion_aside(tmp_path):
    # Ten minutes in a car park with the noise of a receiver, then a drive.
    rng = np.random.default_rng(1)
    poses = np.concatenate([np.tile(drive()[:1], (6000, 1)), drive()])
    poses[:, :2] += rng.normal(0.0, 0.3, (len(poses), 2))
    assert len(read_odometry(write_tum(poses, tmp_path / 'noisy.tum')).steps) == len(poses) - 1


def test_a_drive_that_reverses_at_times_is_read(tmp_path):
    poses = drive()
    back = np.concatenate([poses[:300], poses[300:100:-1], poses[100:]])
    steps = read_odometry(write_tum(back, tmp_path / 'back.tum')).steps
    assert sum(step.distance < 0.0 for step in steps) == pytest.approx(200, abs=2)


def test_a_trajectory_without_stamps_or_order_is_refused(tmp_path):
    path = tmp_path / 'poses.txt'
    path.write_text('1 0 0 0 0 1 0 0 0 0 1 0\n' * 3)
    with pytest.raises(SourceError, match='has no stamps: give a trajectory in the TUM format'):
        read_odometry(path)
    path = write_tum(drive()[:5], tmp_path / 'late.tum', interval=-0.1)
    with pytest.raises(SourceError, match='rise'):
        read_odometry(path)


def test_a_repeated_picture_does_not_move_the_vehicle(tmp_path):
    # The motion goes on: with a vehicle that halts for a frame, that frame is repeated as well.
    frames = list(rolled_frames([2, 3, 4, 20, 20, 3, 2, 4, 3, 2]))
    frames.insert(4, replace(frames[3], stamp_ns=(frames[3].stamp_ns + frames[4].stamp_ns) // 2))
    result = replay(frames, Parameters(**GIVEN), source='a drive')
    assert [update.status for update in result.updates].count(PairStatus.REPEATED) == 1
    write_chain_code(result, tmp_path / 'chain_code.json')
    write_shifts(result, tmp_path / 'shifts.csv')

    for odometry in (odometry_of(result), read_odometry(tmp_path)):
        assert len(odometry.steps) == len(result.updates)
        assert [step.distance for step in odometry.steps].count(0.0) == 1
        assert sum(step.distance for step in odometry.steps) == pytest.approx(
            result.way.distance, abs=1e-3)


@pytest.mark.parametrize('connectivity', [4, 8])
def test_the_line_of_equal_links_is_read(tmp_path, connectivity):
    # 100 m ahead, 50 m to the left, 30 m ahead again.
    code = LinkCode(10.0, connectivity=connectivity)
    for metres, heading in ((100.0, 0.0), (50.0, math.pi / 2), (30.0, 0.0)):
        for _ in range(round(metres)):
            code.add(1.0, heading, 0.0)
    (tmp_path / 'links.txt').write_text(f'{describe_links(code, unit="m")}\n')

    odometry = read_odometry(tmp_path / 'links.txt')
    assert odometry.link == 10.0 and odometry.scale == IN_METRES
    heading, place = 0.0, 0j
    for step in odometry.steps:
        heading += step.yaw
        place += step.distance * complex(math.cos(heading), math.sin(heading))
    assert place == pytest.approx(130 + 50j, abs=25.0)
    assert len(odometry.steps) == len(odometry.stamps_ns) - 1 == 18


@pytest.mark.parametrize(('line', 'message'), [
    ('step 10 m; links 3 (0:0 1:3 2:0 3:0) 1x2', 'add up'),
    ('step 10 m; links 3 (0:0 1:3 2:0 3:0) ... 1x2', 'older ones'),
    ('step 10 m; links 3 (0:0 1:3 2:0 3:0) 1x2...', 'cut off: .* --full-length'),
    ('step 10 m; links 0 (0:0 1:0 2:0 3:0)', 'has no link: the drive is shorter than one'),
    ('step 10 step; links 3 (0:0 1:3 2:0 3:0) 1x3', "unit 'step': give links in m"),
    ('step 0 m; links 3 (0:0 1:3 2:0 3:0) 1x3', 'give links of'),
    ('step 900000000 m; links 3 (0:0 1:3 2:0 3:0) 1x3', 'give links of'),
    (f'step {"9" * 400} m; links 3 (0:0 1:3 2:0 3:0) 1x3', 'give links of'),
    ('step 10 m; links 900000000 (0:0 1:900000000 2:0 3:0) 1x900000000', 'at most'),
])
def test_links_that_are_not_all_there_are_refused(tmp_path, line, message):
    (tmp_path / 'links.txt').write_text(line)
    with pytest.raises(SourceError, match=message):
        read_odometry(tmp_path / 'links.txt')


LINE = 'step 10 m; links 3 (0:0 1:2 2:1 3:0) 1x2 2x1'


@pytest.mark.parametrize('content', [
    f'\ufeff{LINE}\r\n'.encode(), f'data: {LINE}\n---\n'.encode(),
    f"---\ndata: 'step 10 m; links 1 (0:0 1:1 2:0 3:0) 1x1'\n---\ndata: '{LINE}'\n---\n".encode(),
    f'# of the drive to the mill\n\n{LINE}\n'.encode(),
    f"A message was lost!!!\n\ttotal count: 1---\ndata: '{LINE}'\n".encode(),
    f'{LINE}\n---\nA message was lost!!!\n\ttotal count: 2---\n'.encode()])
def test_links_as_a_topic_or_an_editor_writes_them(tmp_path, content):
    (tmp_path / 'links.txt').write_bytes(content)
    odometry = read_odometry(tmp_path / 'links.txt')
    assert odometry.link == 10.0 and len(odometry.steps) == 3


@pytest.mark.parametrize(('content', 'message'), [
    ('', 'is empty: give poses or a line of equal links'), ('\n \n', 'is empty'),
    ('# only a comment\n', 'holds neither poses nor a line of equal links'),
    ("A message was lost!!!\n\ttotal count change:1\ndata: ''\n---\n", 'holds neither poses nor')])
def test_a_file_without_a_drive_says_so(tmp_path, content, message):
    (tmp_path / 'links.txt').write_text(content)
    with pytest.raises(SourceError, match=message):
        read_odometry(tmp_path / 'links.txt')


def test_a_u_turn_between_missing_poses_is_an_interruption(tmp_path):
    out = np.column_stack([np.arange(0.0, 1001.0, 50.0), np.zeros((21, 2))])
    back = np.column_stack([out[::-1, 0] + 200.0, np.full(21, 10.0), np.full(21, math.pi)])
    path = write_tum(np.concatenate([out, back]), tmp_path / 'back.tum', interval=5.0)
    drive = read_odometry(path)
    # Across the mean heading, nothing is driven along it.
    [missing] = drive.motions[20]
    assert isinstance(missing, Interruption) and missing.distance >= 200.0
    assert len(drive.steps) == 40


def test_a_corrected_pose_is_not_driven_to(tmp_path):
    poses = np.column_stack([np.arange(0.0, 101.0), np.zeros((101, 2))])
    poses[50:, 0] += 40.0
    drive = read_odometry(write_tum(poses, tmp_path / 'corrected.tum'))
    [corrected] = drive.motions[49]
    assert isinstance(corrected, Interruption) and corrected.distance >= 41.0
    assert len(drive.steps) == 99
