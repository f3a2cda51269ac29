# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""True trajectories from KITTI and TUM files."""

import numpy as np
from phase_traj_ros.errors import ResultError, SourceError
from phase_traj_ros.synthetic import poses_from_kitti
from phase_traj_ros.tasks.evaluation.ground_truth import match, read_ground_truth
import pytest

SECOND = 10**9


def drive(count=60):
    """Return x, y, yaw of a drive: straight on, then a right-angled bend to the left."""
    yaw = np.clip(np.arange(count) - 20, 0, 30) / 30 * np.pi / 2
    steps = np.stack([np.cos(yaw), np.sin(yaw)], axis=1)[:-1]
    return np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)]), yaw


def kitti_rows(xy, yaw, *, start=0.0, place=(0.0, 0.0, 0.0)):
    """Return lines of KITTI poses; the whole world is turned by ``start`` and moved."""
    rows = []
    for (x, y), angle in zip(xy, yaw):
        sine, cosine = np.sin(-(angle + start)), np.cos(-(angle + start))
        rotation = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
        forward, left = (
            np.cos(start) * x - np.sin(start) * y, np.sin(start) * x + np.cos(start) * y)
        position = np.array([-left, 0.0, forward]) + place
        rows.append(np.concatenate([rotation, position[:, None]], axis=1).ravel())
    return np.array(rows)


def tum_rows(xy, yaw, times, *, optical=False):
    rows = []
    for (x, y), angle, time in zip(xy, yaw, times):
        turned = np.array([0.0, 0.0, np.sin(angle / 2), np.cos(angle / 2)])
        if optical:
            # A camera's axes in the same world: x right, y down, z forward.
            turned = product(turned, np.array([-0.5, 0.5, -0.5, 0.5]))
        rows.append([time, x, y, 0.0, *turned])
    return np.array(rows)


def product(a, b):
    """Return the product of two quaternions, x y z w."""
    vector = a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])
    return np.array([*vector, a[3] * b[3] - a[:3] @ b[:3]])


@pytest.fixture
def write(tmp_path):
    """Return a writer of tables."""
    def written(rows, name='poses.txt', head=''):
        path = tmp_path / name
        np.savetxt(path, rows, fmt='%.9f', header=head)
        return path
    return written


@pytest.mark.parametrize(('start', 'place'), [(0.0, (0, 0, 0)), (2.5, (100.0, -3.0, 40.0))])
def test_kitti_poses_are_rebased(write, start, place):
    xy, yaw = drive()
    truth = read_ground_truth(write(kitti_rows(xy, yaw, start=start, place=place)))
    assert truth.stamps_ns is None and len(truth.headings) == 60
    np.testing.assert_allclose(truth.headings, yaw, atol=1e-6)
    np.testing.assert_allclose(truth.positions, xy, atol=1e-6)


@pytest.mark.parametrize('optical', [False, True])
def test_tum_with_either_axes(write, optical):
    xy, yaw = drive()
    times = np.arange(60) * 0.1 + 5
    truth = read_ground_truth(
        write(tum_rows(xy, yaw, times, optical=optical), 'truth.tum', 'time x y z qx qy qz qw'))
    np.testing.assert_allclose(truth.headings, yaw, atol=1e-6)
    np.testing.assert_allclose(truth.positions, xy, atol=1e-6)
    assert truth.stamps_ns is not None
    assert truth.stamps_ns[[0, 1]].tolist() == [5 * SECOND, 5 * SECOND + SECOND // 10]


def test_stamps_of_an_epoch_keep_their_nanoseconds(tmp_path):
    path = tmp_path / 'truth.tum'
    path.write_text(
        '1700000000.123456789 0 0 0 0 0 0 1\n1700000000.223456791 1 0 0 0 0 0 1\n')
    stamps = read_ground_truth(path).stamps_ns
    assert stamps.tolist() == [1_700_000_000_123_456_789, 1_700_000_000_223_456_791]


def test_kitti_times_beside_or_in_front(write):
    xy, yaw = drive()
    rows, times = kitti_rows(xy, yaw), np.arange(60) * 0.1
    in_front = read_ground_truth(write(np.column_stack([times, rows]), 'timed.txt'))
    write(times, 'times.txt')
    beside = read_ground_truth(write(rows))
    assert beside.stamps_ns.tolist() == in_front.stamps_ns.tolist()
    assert beside.stamps_ns[3] == 300_000_000
    np.testing.assert_allclose(beside.headings, in_front.headings)
    # Times of other poses do not belong to them.
    with pytest.raises(SourceError, match=r'times.txt has 60 lines for the 50 poses of'):
        read_ground_truth(write(rows[:50], 'part.txt'))


def test_times_beside_a_link_come_first(write, tmp_path):
    xy, yaw = drive()
    poses = write(kitti_rows(xy, yaw))
    link = tmp_path / 'mine' / 'poses.txt'
    link.parent.mkdir()
    link.symlink_to(poses)
    write(np.arange(60) * 0.1, 'times.txt')
    assert read_ground_truth(link).stamps_ns[1] == 100_000_000
    np.savetxt(link.parent / 'times.txt', np.arange(60) * 0.5)
    assert read_ground_truth(link).stamps_ns[1] == 500_000_000


def test_agrees_with_the_poses_that_drives_are_rendered_along(kitti_root):
    path = kitti_root / '00' / 'poses.txt'
    expected = poses_from_kitti(np.loadtxt(path))
    truth = read_ground_truth(path)
    np.testing.assert_allclose(
        truth.headings, expected[:, 2] - expected[0, 2], atol=np.radians(0.05))
    assert truth.stamps_ns is not None


def test_matched_by_index(write):
    xy, yaw = drive()
    truth = read_ground_truth(write(kitti_rows(xy, yaw)))
    stamps = np.arange(60) * 100 + 7
    true = match(truth, stamps)
    np.testing.assert_allclose(true.headings, yaw)
    assert true.frames.tolist() == list(range(60))
    assert true.stamps_ns.tolist() == stamps.tolist()


@pytest.mark.parametrize('numbers', [range(0, 60, 2), range(5, 60), [0, 3, 4, 30, 59]])
def test_matched_by_the_number_of_the_frame_in_its_source(write, numbers):
    xy, yaw = drive()
    truth = read_ground_truth(write(kitti_rows(xy, yaw)))
    numbers = np.array(numbers)
    for counts in ({60}, {70, 60}, ()):
        true = match(truth, numbers * 100, numbers=numbers, counts=counts)
        assert true.frames.tolist() == list(range(len(numbers)))
        np.testing.assert_allclose(true.headings, yaw[numbers] - yaw[numbers[0]])


@pytest.mark.parametrize(('numbers', 'counts', 'known'), [
    (None, (), '40'), (range(40), (61,), '61'), (range(40), (50, 200), '50 or 200'),
    (range(30, 70), (), 'at least 70')])
def test_numbers_of_poses_and_frames_that_do_not_fit(write, numbers, counts, known):
    truth = read_ground_truth(write(kitti_rows(*drive())))
    with pytest.raises(ResultError, match=f'60 poses without times, and the recording {known} fr'):
        match(
            truth, np.arange(40), counts=counts,
            numbers=None if numbers is None else np.array(numbers))


def test_matched_by_time_and_interpolated(write):
    xy, yaw = drive()
    truth = read_ground_truth(write(tum_rows(xy, yaw, np.arange(60) * 0.1)))
    stamps = np.array([2.05, 2.55, 3.05]) * SECOND
    true = match(truth, stamps.astype(np.int64))
    expected = np.interp([20.5, 25.5, 30.5], np.arange(60), yaw)
    np.testing.assert_allclose(true.headings, expected - expected[0], atol=1e-6)
    assert true.headings[0] == 0.0 and true.positions[0].tolist() == [0.0, 0.0]
    # The first step from there is straight ahead, as always.
    assert true.positions[1, 0] > 4.5 and abs(true.positions[1, 1]) < 1.0


def test_frames_outside_the_truth_are_left_out(write):
    xy, yaw = drive()
    truth = read_ground_truth(write(tum_rows(xy, yaw, np.arange(60) * 0.1 + 3)))
    stamps = (np.arange(0, 20) * SECOND).astype(np.int64)
    true = match(truth, stamps)
    assert true.frames.tolist() == [3, 4, 5, 6, 7, 8]


def test_a_hole_in_a_turn_of_the_truth_is_refused(write):
    xy, yaw = drive()
    times, stamps = np.arange(60) * 0.1, (np.arange(0.0, 5.9, 0.1) * SECOND).astype(np.int64)
    hole = np.delete(tum_rows(xy, yaw, times), range(25, 40), axis=0)
    with pytest.raises(ResultError, match=r'no pose for 1\.6 s, from 2\.4 s after'):
        match(read_ground_truth(write(hole)), stamps)
    # Outside of the replay, or where the vehicle rests or drives straight on, nothing is missing.
    match(read_ground_truth(write(hole)), stamps[:20])
    rest = tum_rows(xy[[*range(30)] + [29] * 30], yaw[[*range(30)] + [29] * 30], times)
    match(read_ground_truth(write(np.delete(rest, range(35, 55), axis=0))), stamps)
    straight = np.delete(tum_rows(xy, yaw, times), range(2, 18), axis=0)
    match(read_ground_truth(write(straight)), stamps)
    # Six seconds are too long, however far apart poses are.
    with pytest.raises(ResultError, match=r'no pose for 5\.9 s'):
        match(read_ground_truth(write(tum_rows(xy, yaw, times)[[0, -1]])), stamps)
    turns = tum_rows(np.zeros((60, 2)), yaw, times)
    with pytest.raises(ResultError, match='no pose'):
        match(read_ground_truth(write(np.delete(turns, range(25, 40), axis=0))), stamps)


def test_unrelated_clocks_start_together_if_asked_for(write):
    xy, yaw = drive()
    truth = read_ground_truth(write(tum_rows(xy, yaw, np.arange(60) * 0.1)))
    stamps = 1_700_000_000 * SECOND + np.arange(60) * (SECOND // 10)
    with pytest.raises(ResultError, match=r'from 0.000 to 5.900 s, .* 1700000000.0.*align_start'):
        match(truth, stamps)
    np.testing.assert_allclose(
        match(truth, stamps, align_start=True).headings, yaw, atol=1e-6)


@pytest.mark.parametrize(('text', 'message'), [
    ('', 'fewer than two'),
    ('1 2 3\n1 2 3\n', '3 columns'),
    ('0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0\n', 'pose 2: 7 columns'),
    ('0 0 0 0 0 0 0 2\n1 0 0 0 0 0 0 2\n', 'not quaternions'),
    ('0 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n', 'do not rise'),
    ('x 0 0 0 0 0 0 1\ny 0 0 0 0 0 0 1\n', "'x' is not a time in seconds"),
    # Nanoseconds of an epoch, as some recorders write them.
    (f'{16 * 10**17} 0 0 0 0 0 0 1\n{17 * 10**17} 0 0 0 0 0 0 1\n', 'not a time in seconds'),
    ('1e300 0 0 0 0 0 0 1\n2e300 0 0 0 0 0 0 1\n', 'not a time in seconds'),
    ('0 0 0 nan 0 0 0 1\n1 0 0 0 0 0 0 1\n', 'NaN'),
    ('0 a 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n', 'else than poses'),
    ('1 2 3 4 5 6 7 8 9 10 11 12\n' * 2, 'not rotations'),
])
def test_refuses_invalid_trajectories(tmp_path, text, message):
    path = tmp_path / 'truth.txt'
    path.write_text(text)
    with pytest.raises(SourceError, match=message):
        read_ground_truth(path)


def test_reads_a_file_with_a_byte_order_mark(tmp_path):
    path = tmp_path / 'truth.txt'
    path.write_text('# Grüße\n0 0 0 0 0 0 0 1\n1 2 0 0 0 0 0 1\n', encoding='utf-8-sig')
    assert read_ground_truth(path).positions[1].tolist() == [2.0, 0.0]


def test_refuses_unreadable_files(tmp_path):
    with pytest.raises(SourceError, match=r'absent.txt cannot be read: No such file'):
        read_ground_truth(tmp_path / 'absent.txt')
    (tmp_path / 'noise.txt').write_bytes(bytes(range(256)))
    with pytest.raises(SourceError, match=r'noise.txt cannot be read: it is not a text file'):
        read_ground_truth(tmp_path / 'noise.txt')
