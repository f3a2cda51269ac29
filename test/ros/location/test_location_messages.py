# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages of a located vehicle."""

import math

import numpy as np
from phase_traj_ros.core import Corner
from phase_traj_ros.core.localization.estimate import Candidate, LocationEstimate
from phase_traj_ros.core.path.odometry import Odometry
from phase_traj_ros.io.maps.projection import LocalProjection
from phase_traj_ros.io.maps.road_classes import Roads
from phase_traj_ros.parameters import specs
from phase_traj_ros.ros.location.messages import (
    candidate_markers,
    fix_message,
    map_to_odom,
    odometry_message,
    position_fix,
    road_markers,
)
from phase_traj_ros.ros.outputs.messages import MESSAGES
from phase_traj_ros.tasks.location.run import UNKNOWN
import pytest
from sensor_msgs.msg import NavSatFix, NavSatStatus
from visualization_msgs.msg import Marker

PLANE = LocalProjection(49.0, 8.4)
HEADER = MESSAGES.header(5_000_000_007, 'map')


def estimate(*, claimed=True, x=30.0, y=40.0, heading=1.0):
    return LocationEstimate(
        5_000_000_007, claimed, x, y, heading, 0.995,
        ((4.0, 1.0, 0.1), (1.0, 9.0, 0.2), (0.1, 0.2, 0.01)), 1.0, 0.01)


def odometry(x=10.0, y=-5.0, yaw=0.25):
    return Odometry(
        Corner(x, y, yaw, 5_000_000_007), 8.0, 0.1, 0.04, 0.001,
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.01)))


def test_a_known_place_is_a_fix_of_known_covariance():
    message = fix_message(estimate(), 5_000_000_007, 'base_link', PLANE)

    assert message.status.status == NavSatStatus.STATUS_FIX
    assert PLANE.to_metres(message.latitude, message.longitude) == pytest.approx([30.0, 40.0])
    assert message.position_covariance_type == NavSatFix.COVARIANCE_TYPE_KNOWN
    assert message.position_covariance[[0, 1, 3, 4]].tolist() == [4.0, 1.0, 1.0, 9.0]
    assert math.isnan(message.altitude) and message.header.frame_id == 'base_link'
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (5, 7)


@pytest.mark.parametrize('place', [UNKNOWN, estimate(claimed=False)])
def test_an_unknown_place_is_no_fix(place):
    message = fix_message(place, 5_000_000_007, 'base_link', PLANE)

    assert message.status.status == NavSatStatus.STATUS_NO_FIX
    assert math.isnan(message.latitude) and math.isnan(message.longitude)


def test_a_fix_is_read_as_it_is_written():
    fix = position_fix(fix_message(estimate(), 1, 'gps', PLANE), PLANE)

    assert (fix.x, fix.y) == (pytest.approx(30.0), pytest.approx(40.0))
    assert (fix.variance_x, fix.variance_y, fix.covariance_xy) == (4.0, 9.0, 1.0)


def received(**fields):
    """Return a fix with the status of a receiver that has a position."""
    return NavSatFix(
        latitude=49.0, longitude=8.4, status=NavSatStatus(status=NavSatStatus.STATUS_FIX),
        **fields)


def test_a_fix_without_a_covariance_has_ten_metres():
    message = received()

    assert position_fix(message, PLANE).variance_x == 100.0


@pytest.mark.parametrize('kind', [
    NavSatFix.COVARIANCE_TYPE_KNOWN, NavSatFix.COVARIANCE_TYPE_UNKNOWN])
def test_a_fix_has_its_stamp(kind):
    message = received(position_covariance=np.eye(3).reshape(-1), position_covariance_type=kind)

    # Some drivers leave it 0: then it is that of the newest pair.
    assert position_fix(message, PLANE).stamp_ns is None
    message.header = HEADER
    assert position_fix(message, PLANE).stamp_ns == 5_000_000_007


def test_what_is_no_fix_is_left_out():
    message = received()
    message.status.status = NavSatStatus.STATUS_NO_FIX
    assert position_fix(message, PLANE) is None
    for latitude in (math.nan, math.inf):
        message = received()
        message.latitude = latitude
        with np.errstate(invalid='raise'):
            assert position_fix(message, PLANE) is None
    with pytest.raises(ValueError, match='status is not set'):
        position_fix(NavSatFix(latitude=49.0, longitude=8.4), PLANE)
    broken = received(
        position_covariance=np.full(9, -1.0),
        position_covariance_type=NavSatFix.COVARIANCE_TYPE_KNOWN)
    with pytest.raises(ValueError, match='covariance of the fix'):
        position_fix(broken, PLANE)


@pytest.mark.parametrize('known', [None, odometry()])
def test_a_known_place_is_an_odometry_in_the_map(known):
    message = odometry_message(estimate(), known, HEADER, 'base_link')

    assert (message.header.frame_id, message.child_frame_id) == ('map', 'base_link')
    assert (message.pose.pose.position.x, message.pose.pose.position.y) == (30.0, 40.0)
    assert 2 * math.atan2(
        message.pose.pose.orientation.z, message.pose.pose.orientation.w) == pytest.approx(1.0)
    assert message.pose.covariance.reshape(6, 6)[np.ix_((0, 1, 5), (0, 1, 5))].tolist() == [
        [4.0, 1.0, 0.1], [1.0, 9.0, 0.2], [0.1, 0.2, 0.01]]
    assert message.twist.twist.linear.x == (0.0 if known is None else 8.0)
    assert (message.twist.covariance[0] < 1.0) == (known is not None)


def test_map_to_odom_carries_the_odometry_to_the_place():
    x, y, turn = map_to_odom(estimate(), odometry())

    assert x + math.cos(turn) * 10.0 - math.sin(turn) * -5.0 == pytest.approx(30.0)
    assert y + math.sin(turn) * 10.0 + math.cos(turn) * -5.0 == pytest.approx(40.0)
    assert turn + 0.25 == pytest.approx(1.0)


def test_roads_are_segments():
    [marker] = road_markers(
        [np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 5.0]]), np.array([[1.0, 1.0], [2.0, 2.0]])],
        HEADER).markers

    assert marker.type == Marker.LINE_LIST and marker.header.frame_id == 'map'
    assert [(each.x, each.y) for each in marker.points] == [
        (0.0, 0.0), (5.0, 0.0), (5.0, 0.0), (5.0, 5.0), (1.0, 1.0), (2.0, 2.0)]


def test_new_candidates_replace_the_old_ones():
    markers = candidate_markers(
        [Candidate(1.0, 2.0, 0.0, 0.6), Candidate(3.0, 4.0, 0.0, 0.1)], HEADER).markers

    assert markers[0].action == Marker.DELETEALL
    assert [(each.pose.position.x, each.id) for each in markers[1:]] == [(1.0, 0), (3.0, 1)]
    assert markers[1].scale.x > markers[2].scale.x > 0.0


def test_the_parameter_has_the_roads_of_the_maps():
    [spec] = [spec for spec in specs() if spec.name == 'map_roads']

    assert spec.choices == tuple(each.value for each in Roads)
