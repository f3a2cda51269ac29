# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Drives: the motion that follows from a plan, and its ground truth."""

from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.synthetic import (
    DRIVES,
    named_drive,
    plan_drive,
    pose_drive,
    poses_from_kitti,
    Straight,
    TrueTurn,
    Turn,
)
from phase_traj_ros.synthetic.camera import BODY_TO_PICTURE, rotation
from phase_traj_ros.synthetic.drive.plan import drive_plan
import pytest

SEGMENT = st.one_of(
    st.builds(Straight, st.floats(0.1, 5)),
    st.builds(Turn, st.floats(-180, 180), st.floats(0.5, 5)))


@pytest.mark.parametrize(('name', 'frames', 'quarters'), [
    ('demo', 201, [1, -1, 1]), ('paper_case_1', 241, [-1, -1]),
    ('paper_case_2', 200, [1, -1, -1])])
def test_named_drives(name, frames, quarters):
    drive = named_drive(name)
    assert len(drive) == frames
    assert [turn.angle_deg for turn in drive.turns] == [90 * quarter for quarter in quarters]
    assert drive.stamps_ns[0] == 1_700_000_000_000_000_000
    assert (np.diff(drive.stamps_ns) == 100_000_000).all()


@pytest.mark.parametrize('name', DRIVES)
def test_true_turns_add_up_to_the_yaw(name):
    drive = named_drive(name)
    yaw = drive.poses[:, 2]
    steps, covered = np.diff(yaw), np.zeros(len(drive) - 1, bool)
    for turn in drive.turns:
        turned = np.degrees(yaw[turn.end_frame] - yaw[turn.start_frame])
        assert turned == pytest.approx(turn.angle_deg)
        covered[turn.start_frame:turn.end_frame] = True
    assert np.abs(steps[~covered]).max() < 1e-9
    # A quarter turn in 3 s: peaks well above every threshold of the paper's experiments.
    shifts = drive.camera.focal * np.tan(np.abs(steps))
    assert 45 < shifts.max() < 52


def test_an_unknown_drive_is_refused():
    with pytest.raises(ParameterError, match='demo, paper_case_1, paper_case_2'):
        named_drive('nowhere')


@given(st.lists(SEGMENT, min_size=1, max_size=5))
def test_a_plan_turns_by_its_angles_and_keeps_its_speed(plan):
    total = sum(segment.seconds for segment in plan)
    (x, y, yaw) = drive_plan(plan, np.linspace(0, total, 400), speed=5.0).T
    assert np.degrees(yaw[-1]) == pytest.approx(
        sum(segment.angle_deg for segment in plan), abs=1e-6)
    moved = np.hypot(np.diff(x), np.diff(y))
    assert moved.max() <= 5.0 * total / 399 + 1e-9
    assert (x[0], y[0], yaw[0]) == (0, 0, 0)


def test_a_left_turn_leads_to_the_left():
    (x, y, yaw) = drive_plan([Turn(90, 3.0)], np.linspace(0, 3, 31), speed=6.0).T
    assert x[-1] > 5
    assert y[-1] == pytest.approx(x[-1], rel=1e-3)
    assert (np.diff(yaw) >= 0).all()
    rates = np.diff(yaw) * 10
    assert rates.max() == pytest.approx(np.pi / 2 / 3 * 4 / 3, rel=1e-6)
    # Smooth: the rate never jumps.
    assert np.abs(np.diff(rates)).max() < 0.2


def test_a_vehicle_brakes_and_stops():
    plan = [Straight(3.0), Straight(4.0, speed=0.0), Straight(3.0)]
    x = drive_plan(plan, np.arange(0, 10.01, 0.1), speed=8.0)[:, 0]
    speed = np.diff(x) * 10
    assert speed[:19] == pytest.approx(8.0)
    assert np.abs(speed[31:69]).max() < 1e-9
    assert speed[81:] == pytest.approx(8.0)
    assert np.abs(np.diff(speed)).max() <= 0.81


def test_a_vehicle_reverses_and_turns_about():
    plan = [Straight(2.0, speed=0.0), Turn(90.0, 6.0, speed=-2.0), Straight(2.0, speed=0.0),
            Straight(3.0)]
    x, y, yaw = drive_plan(plan, np.arange(0, 13.01, 0.1), speed=3.0).T
    assert np.degrees(yaw[[20, 80, -1]]) == pytest.approx([0.0, 90.0, 90.0])
    # Backwards, it first moves against its heading, and turns its tail to the right.
    assert x[80] < -4.0 and y[80] < -4.0
    assert np.abs(np.diff(x[81:])).max() < 1e-9 and y[-1] - y[100] == pytest.approx(7.5, abs=0.1)


def test_a_drive_at_another_rate_takes_as_long():
    drive = plan_drive('d', [Straight(1.0), Turn(90), Straight(1.0)], rate_hz=20.0)
    assert len(drive) == 101
    assert drive.stamps_ns[-1] - drive.stamps_ns[0] == 5_000_000_000
    assert drive.turns == (TrueTurn(20, 80, 90),)


def test_stamps_do_not_drift():
    drive = plan_drive('d', [Straight(100.0)], rate_hz=30.0)
    assert drive.stamps_ns[3000] - drive.stamps_ns[0] == 100_000_000_000


@pytest.mark.parametrize('plan', [
    [], [Straight(0.0)], [Straight(float('nan'))], [Turn(float('inf'))],
    [Straight(1.0, speed=float('inf'))]])
def test_a_plan_that_cannot_be_driven_is_refused(plan):
    with pytest.raises(ParameterError):
        plan_drive('d', plan)


@pytest.mark.parametrize('rate', [0.0, -1.0, float('nan')])
def test_invalid_rates_are_refused(rate):
    with pytest.raises(ParameterError, match='rate'):
        plan_drive('d', [Straight(1.0)], rate_hz=rate)


def test_arrays_of_a_drive_are_read_only():
    drive = named_drive('demo')
    with pytest.raises(ValueError, match='read-only'):
        drive.poses[0, 0] = 1.0


def test_taking_frames_keeps_stamps_and_maps_turns():
    drive = plan_drive('d', [Straight(1.0), Turn(90), Straight(1.0), Turn(-90), Straight(1.0)])
    half = drive.take(np.arange(0, 70, 2))
    np.testing.assert_array_equal(half.stamps_ns, drive.stamps_ns[0:70:2])
    assert half.turns == (TrueTurn(5, 20, 90),)
    yaw = np.degrees(half.poses[:, 2])
    assert yaw[20] - yaw[5] == pytest.approx(90)


def test_poses_without_tilt_are_level():
    drive = pose_drive('d', np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.1]]))
    assert drive.pose(1) == (1.0, 0.0, 0.1, 0.0, 0.0)


@pytest.mark.parametrize('poses', [np.zeros((0, 3)), np.zeros((4, 4)), np.zeros(3)])
def test_poses_of_another_shape_are_refused(poses):
    with pytest.raises(ParameterError, match='shape'):
        pose_drive('d', poses)


@given(st.lists(st.tuples(
    st.floats(-100, 100), st.floats(-100, 100), st.floats(-3, 3), st.floats(-0.3, 0.3),
    st.floats(-0.3, 0.3)), min_size=1, max_size=4))
def test_kitti_poses_come_back_in_ros_axes(poses):
    lines = []
    for (x, y, yaw, pitch, roll) in poses:
        turned = BODY_TO_PICTURE @ rotation(yaw, pitch, roll) @ BODY_TO_PICTURE.T
        place = BODY_TO_PICTURE @ (x, y, 1.0)
        lines.append(np.concatenate([turned, place[:, None]], axis=1).ravel())
    back = poses_from_kitti(lines)
    wrapped = (back - poses)[:, 2] / (2 * np.pi)
    np.testing.assert_allclose(wrapped, np.rint(wrapped), atol=1e-9)
    np.testing.assert_allclose(
        np.delete(back, 2, axis=1), np.delete(np.array(poses), 2, axis=1), atol=1e-9)


def test_a_kitti_camera_that_goes_forward_and_turns_right_has_negative_yaw():
    (cos, sin) = (np.cos(0.2), np.sin(0.2))
    # Columns of the rotation are the camera's axes; z, ahead, has turned to x, the right.
    matrix = np.array([[cos, 0, sin, 0.5], [0, 1, 0, 0], [-sin, 0, cos, 3.0]])
    (x, y, yaw, pitch, roll) = poses_from_kitti(matrix.reshape(1, 12))[0]
    assert (x, y, yaw) == pytest.approx((3.0, -0.5, -0.2))
    assert (pitch, roll) == pytest.approx((0, 0))


def test_kitti_yaw_is_continuous_over_a_whole_turn():
    angles = np.linspace(0, 4 * np.pi, 60)
    (zero, one) = (np.zeros(60), np.ones(60))
    lines = np.stack([
        np.cos(angles), zero, np.sin(angles), zero, zero, one, zero, zero,
        -np.sin(angles), zero, np.cos(angles), zero], axis=1)
    np.testing.assert_allclose(poses_from_kitti(lines)[:, 2], -angles, atol=1e-9)


@pytest.mark.parametrize('matrices', [np.zeros((3, 11)), np.zeros(12), np.full((1, 12), np.nan)])
def test_invalid_kitti_poses_are_refused(matrices):
    with pytest.raises(ParameterError, match='12 finite numbers'):
        poses_from_kitti(matrices)
