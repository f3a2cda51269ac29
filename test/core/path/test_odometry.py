# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The odometry from heading and way."""

import math

import numpy as np
from odometry_pairs import gone, step, TENTH
from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.path.heading_path import HeadingPath
from phase_traj_ros.core.path.odometry import Odometer
from phase_traj_ros.core.road.travel import Travel, TravelState
import pytest


def test_a_quarter_circle():
    odometer, yaw = Odometer(HeadingPath()), math.pi / 2 / 90
    radius = 10.0
    for index in range(1, 91):
        found = odometer.update(
            step(yaw, index * yaw), gone(radius * yaw), index * TENTH, 0.1)
    assert (found.pose.x, found.pose.y) == pytest.approx((radius, radius), rel=1e-3)
    assert found.pose.yaw == pytest.approx(math.pi / 2)
    assert found.speed == pytest.approx(radius * yaw / 0.1)
    assert found.yaw_rate == pytest.approx(yaw / 0.1)


def test_a_foreseen_frame_has_the_errors_of_what_is_foreseen_and_changes_nothing():
    odometer, other = Odometer(HeadingPath()), Odometer(HeadingPath())
    ahead = HeadingStep(0.0, 0.0, 0.0, False, 0.002 ** 2, foreseen=0.01)
    for each in (odometer, other):
        newest = each.update(step(0.0, 0.0), gone(1.0), TENTH, 0.1)
    seen = odometer.foresee(ahead, Travel(0.5, 0.3 ** 2, TravelState.BRIDGED), 2 * TENTH, 0.1)
    assert (seen.pose.x, seen.pose.y) == pytest.approx((newest.pose.x + 0.5, 0.0))
    grown = np.array(seen.covariance) - np.array(newest.covariance)
    assert grown == pytest.approx(np.diag([0.3 ** 2, 0.3 ** 2, 0.002 ** 2 + 0.01 ** 2]))
    # Off by a hundredth of a radian in a tenth of a second.
    assert seen.yaw_rate_variance - newest.yaw_rate_variance == pytest.approx(0.1 ** 2)
    after, expected = (
        each.update(step(0.0, 0.0), gone(1.0), 2 * TENTH, 0.1) for each in (odometer, other))
    assert after == expected


def test_nothing_that_is_measured_is_exact():
    stood = Travel(0.0, 0.0, TravelState.STANDING)
    found = Odometer(HeadingPath()).update(step(0.0, 0.0, deviation=0.0), stood, TENTH, 0.1)
    # A picture shows whether a vehicle creeps, but not that nothing moves at all.
    assert 0.002 < math.sqrt(found.speed_variance) < 0.05
    assert 0.002 < math.degrees(math.sqrt(found.yaw_rate_variance)) < 0.05


def test_a_speed_that_is_unknown_counts_in_no_filter():
    odometer = Odometer(HeadingPath())
    odometer.update(step(0.0, 0.0), gone(1.0), TENTH, 0.1)
    lost = Travel(0.0, 1.5 ** 2, TravelState.UNKNOWN)
    found = odometer.update(step(0.0, 0.0), lost, 2 * TENTH, 0.1)
    assert (found.speed, found.speed_variance) == (0.0, 1e6)


def test_a_vehicle_that_stands_does_not_turn():
    driving, standing = Odometer(HeadingPath()), Odometer(HeadingPath())
    stood = Travel(0.0, 0.0, TravelState.STANDING)
    for index in range(100):
        drove = driving.update(step(0.0, 0.0), gone(1.0), index * TENTH, 0.1)
        stays = standing.update(step(0.0, 0.0), stood, index * TENTH, 0.1)
    assert stays.covariance[2][2] < 0.1 * drove.covariance[2][2]
    assert not np.any(np.array(stays.covariance)[:2, :2])
