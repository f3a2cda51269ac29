# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How the camera is mounted, from transforms as they are on /tf_static."""

from dataclasses import replace
import math
from types import SimpleNamespace

import numpy as np
from phase_traj_ros.core import Corner, PairStatus, Update
from phase_traj_ros.core.path.odometry import Odometry
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.messages.static_frames import StaticFrames
from phase_traj_ros.parameters import Parameters
import pytest

# Roll, pitch, yaw of an optical frame in its housing.
OPTICAL = (-90.0, 0.0, -90.0)


def transform(parent, child, place=(0.0, 0.0, 0.0), rpy_deg=(0.0, 0.0, 0.0)):
    """Return the fields of a TransformStamped; angles as in URDF, about fixed axes."""
    roll, pitch, yaw = (math.radians(each) / 2 for each in rpy_deg)
    sr, sp, sy = map(math.sin, (roll, pitch, yaw))
    cr, cp, cy = map(math.cos, (roll, pitch, yaw))
    return SimpleNamespace(
        header=SimpleNamespace(frame_id=parent), child_frame_id=child,
        transform=SimpleNamespace(
            translation=SimpleNamespace(x=place[0], y=place[1], z=place[2]),
            rotation=SimpleNamespace(
                x=sr * cp * cy - cr * sp * sy, y=cr * sp * cy + sr * cp * sy,
                z=cr * cp * sy - sr * sp * cy, w=cr * cp * cy + sr * sp * sy)))


def result(odometry):
    """Return the result of a pair with this odometry."""
    return Update(
        pair=0, stamp_ns=7, interval_ns=10**8, shift=None, step=None, status=PairStatus.OK,
        tip=odometry.pose, odometry=odometry)


def frames(*transforms):
    tree = StaticFrames()
    tree.add(SimpleNamespace(transforms=transforms))
    return tree


@pytest.mark.parametrize('optical', [True, False])
@pytest.mark.parametrize(('rpy', 'pitch', 'roll', 'yaw'), [
    ((0, 0, 0), 0, 0, 0), ((0, 10, 0), 10, 0, 0), ((5, 0, 0), 0, 5, 0), ((0, 0, 20), 0, 0, 20),
    ((3, -8, -15), -8, 3, -15), ((180, 4, 0), 4, 180, 0)])
def test_place_and_angles(optical, rpy, pitch, roll, yaw):
    tree = [transform('base_link', '/mast', (1.0, 0.5, 1.0)),
            transform('mast', 'cam', (0.5, 0.0, 0.6), rpy)]
    if optical:
        tree.append(transform('cam', 'cam_optical', rpy_deg=OPTICAL))
    mount = frames(*tree).mount('base_link', 'cam_optical' if optical else 'cam')
    assert (mount.x, mount.y, mount.height) == pytest.approx((1.5, 0.5, 1.6))
    assert (mount.pitch_deg, mount.yaw_deg) == pytest.approx((pitch, yaw), abs=1e-9)
    assert math.remainder(mount.roll_deg - roll, 360) == pytest.approx(0, abs=1e-9)


def test_the_height_is_that_above_the_ground_where_it_is_known():
    tree = [transform('base_link', 'cam', (1.5, 0.0, 1.3))]
    assert frames(*tree).mount('base_link', 'cam').height == pytest.approx(1.3)
    tree.append(transform('base_footprint', 'base_link', (0.0, 0.0, 0.35)))
    assert frames(*tree).mount('base_link', 'cam').height == pytest.approx(1.65)


def test_the_ground_below_one_of_several_vehicles_has_its_prefix():
    tree = [transform('r1/base_link', 'r1/cam', (1.5, 0.0, 1.3)),
            transform('r1/base_footprint', 'r1/base_link', (0.0, 0.0, 0.35))]
    assert frames(*tree).mount('r1/base_link', 'r1/cam').height == pytest.approx(1.65)


@pytest.mark.parametrize('pitch', [0.0, 30.0, 55.0, -50.0])
def test_the_frame_of_a_picture_or_its_housing_is_known_however_steep_it_is(pitch):
    body = transform('base_link', 'housing', (1.0, 0.0, 1.5), (0.0, pitch, 0.0))
    picture = transform('housing', 'picture', (0.0, 0.0, 0.0), OPTICAL)
    for name in ('housing', 'picture'):
        mount = frames(body, picture).mount('base_link', name)
        assert (mount.pitch_deg, mount.roll_deg, mount.yaw_deg) == pytest.approx(
            (pitch, 0.0, 0.0), abs=1e-6)


def test_what_a_camera_cannot_be_used_for_is_said():
    def doubts(angles, **values):
        mount = frames(transform('base_link', 'cam', (0, 0, 1.5), angles)).mount(
            'base_link', 'cam')
        return mount.fill_in(Parameters(**values)).doubts

    assert not doubts((3.0, 20.0, 10.0)) and not doubts((178.0, 0.0, 0.0), rotate_180=True)
    upside_down, = doubts((178.0, 0.0, 0.0))
    assert 'set rotate_180' in upside_down
    right, = doubts((0.0, 0.0, -30.0))
    assert 'looks 30 degrees to the right' in right
    (rear,), (aside,) = doubts((0.0, 0.0, -172.0)), doubts((0.0, 0.0, 150.0))
    assert 'looks to the rear' in rear and 'looks 150 degrees to the left' in aside
    # The shift of an upside-down picture is reversed; the paper's rule knows no direction.
    assert doubts((178.0, 0.0, -30.0), threshold=4.0) == (upside_down,)


@pytest.mark.parametrize('tree', [
    [], [transform('base_link', 'lidar')], [transform('map', 'cam')],
    [transform('a', 'cam'), transform('cam', 'a')]])
def test_what_is_not_connected_is_unknown(tree):
    assert frames(*tree).mount('base_link', 'cam') is None
    assert frames(*tree).mount('cam', 'cam') is None


def test_a_transform_that_is_not_a_pose_is_left_out():
    broken = transform('base_link', 'cam')
    broken.transform.rotation = SimpleNamespace(x=0.0, y=0.0, z=0.0, w=0.0)
    assert frames(broken).mount('base_link', 'cam') is None
    nowhere = transform('base_link', 'cam', (1.0, math.nan, 1.5))
    assert frames(nowhere).mount('base_link', 'cam') is None


def test_parameters_win_and_what_cannot_be_is_left_out():
    mount = frames(transform('base_link', 'cam', (1.5, 0, 1.6), (2, 5, 0))).mount(
        'base_link', 'cam')
    all_of_it = mount.fill_in(Parameters())
    values = all_of_it.parameters
    assert values.camera_height == pytest.approx(1.6) and values.settings.metric
    assert values.camera_pitch_deg == pytest.approx(5)
    assert values.camera_roll_deg == pytest.approx(2)
    assert str(all_of_it).endswith(
        'from there: camera_height, camera_pitch_deg, camera_roll_deg, the lever arm of odom')
    some = mount.fill_in(Parameters(camera_height=1.2, camera_pitch_deg=3.0))
    assert (some.parameters.camera_height, some.parameters.camera_pitch_deg) == (1.2, 3.0)
    assert str(some).endswith('from there: camera_roll_deg, the lever arm of odom')
    below = frames(transform('base_link', 'cam', (0, 0, -0.1), (0, 80, 0))).mount(
        'base_link', 'cam')
    assert below.fill_in(Parameters()) == Mounting(Parameters(), below)
    # As of a frame that is not that of the vehicle.
    aside = frames(transform('base_link', 'cam', (1.5, -150, 1.6))).mount('base_link', 'cam')
    assert 'lever arm' not in str(aside.fill_in(Parameters()))
    turned = frames(transform('base_link', 'cam', (0, 0, 1), (178, 0, 0))).mount(
        'base_link', 'cam')
    values = turned.fill_in(Parameters(rotate_180=True)).parameters
    assert values.camera_roll_deg == pytest.approx(-2)


@pytest.mark.parametrize(('given', 'used'), [
    ({'threshold': 4.0}, ''),
    ({'threshold': 4.0, 'camera_height': 2.0},
     'camera_pitch_deg, camera_roll_deg, the lever arm of odom'),
    ({'speed': 5.0}, 'camera_pitch_deg, camera_roll_deg'),
    # Where no speed arrives, the distance comes from the road.
    ({'use_speed_topic': True}, 'camera_height, camera_pitch_deg, camera_roll_deg'),
    ({'speed': 5.0, 'camera_pitch_deg': 1.0, 'camera_roll_deg': 1.0}, '')])
def test_only_what_has_an_effect_is_used(given, used):
    mount = frames(transform('base_link', 'cam', (1.5, 0.4, 1.6), (2, 5, 0))).mount(
        'base_link', 'cam')
    assert str(mount.fill_in(Parameters(**given))).partition('from there: ')[2] == used


def test_parameters_that_change_later_keep_the_values_of_the_mount():
    mount = frames(transform('base_link', 'cam', (1.5, 0.4, 1.6), (2, 5, 0))).mount(
        'base_link', 'cam')
    turns, rule = Parameters(), Parameters(threshold=4.0)
    by_turns, by_rule = mount.fill_in(turns), mount.fill_in(rule)
    # The height stays where the paper's rule follows: the camera is known by then.
    assert by_turns.with_given(rule).parameters.camera_height == pytest.approx(1.6)
    assert by_rule.with_given(rule) == by_rule
    assert Mounting(rule).with_given(turns) == Mounting(turns)
    # So does it under another mount, which is known when the turns follow.
    lower = frames(transform('base_link', 'cam', (1.5, 0.2, 0.8), (2, 5, 40))).mount(
        'base_link', 'cam')
    followed = by_turns.with_given(rule).with_mount(lower)
    assert followed.used == by_turns.used and followed.mount == lower
    with pytest.raises(ParameterError, match='threshold would change what is taken'):
        followed.with_given(turns)
    # Upside down, the angles are others.
    for before, given in ((by_rule, turns), (by_turns, Parameters(rotate_180=True))):
        with pytest.raises(ParameterError, match=r'would change .* set it at the start'):
            before.with_given(given)


def along(speeds, yaw_rates, interval):
    """Return where a point that never slips sideways drives to, and its heading."""
    yaws = np.cumsum(yaw_rates) * interval
    ahead = yaws - np.multiply(yaw_rates, interval) / 2
    ways = np.multiply(speeds, interval)
    return float(ways @ np.cos(ahead)), float(ways @ np.sin(ahead)), float(yaws[-1])


@pytest.mark.parametrize('lever', [(1.5, 0.0), (0.0, -0.4), (1.5, 0.4)])
def test_the_origin_drives_where_the_rear_axle_does(lever):
    """The road slides towards the camera as fast as its part of the vehicle moves ahead."""
    mount = frames(transform('base_link', 'cam', (*lever, 1.6))).mount('base_link', 'cam')
    yaw_rates = np.concatenate([np.full(400, 0.4), np.full(300, -0.7), np.zeros(100)])
    speeds = np.linspace(3.0, 6.0, len(yaw_rates))
    x, y, yaw = along(speeds, yaw_rates, 0.01)
    # The camera only moves sideways as well if it is ahead, which is not measured.
    seen = speeds - yaw_rates * lever[1]
    covariance = np.diag([0.01, 0.02, 0.001])
    camera = Odometry(
        Corner(*along(seen, yaw_rates, 0.01), 7), seen[-1], 0.5, speed_variance=0.1,
        yaw_rate_variance=0.01,
        covariance=tuple(map(tuple, covariance.tolist())))

    def at_base(odometry):
        return mount.fill_in(Parameters()).at_base(result(odometry)).odometry

    found = at_base(camera)
    assert (found.pose.x, found.pose.y, found.pose.yaw) == pytest.approx((x, y, yaw), abs=1e-3)
    assert found.speed == pytest.approx(camera.speed + 0.5 * lever[1])
    assert found.speed_variance == pytest.approx(0.1 + 0.01 * lever[1] ** 2)
    assert found.covariance[2][2] == camera.covariance[2][2]
    # By differences, as it is linear for small errors.
    slopes = []
    for moved in np.eye(3) * 1e-6:
        changed = at_base(replace(camera, pose=Corner(
            *np.add((camera.pose.x, camera.pose.y, camera.pose.yaw), moved), 7))).pose
        slopes.append(np.subtract(
            (changed.x, changed.y, changed.yaw), (found.pose.x, found.pose.y, found.pose.yaw)))
    change = np.array(slopes).T / 1e-6
    assert np.array(found.covariance) == pytest.approx(
        change @ covariance @ change.T, abs=1e-6)


def test_before_the_vehicle_has_moved_it_is_at_the_origin():
    mount = frames(transform('base_link', 'cam', (1.5, 0.4, 1.6))).mount('base_link', 'cam')
    start = Odometry(
        Corner(0.0, 0.0, 0.0, 7), 0.0, 0.0, speed_variance=0.0, yaw_rate_variance=0.0,
        covariance=((0.0,) * 3,) * 3)
    pose = mount.fill_in(Parameters()).at_base(result(start)).odometry.pose
    assert (pose.x, pose.y) == (0.0, 0.0)
