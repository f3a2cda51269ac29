# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The way from speeds, and the odometry from heading and way."""

import math

from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.path.odometry import Odometer
from phase_traj_ros.core.path.speed import SpeedTrack
from phase_traj_ros.core.road.travel import Travel, TravelState
import pytest

S = 10**9
TENTH = S // 10


def track(*samples):
    made = SpeedTrack()
    for seconds, speed in samples:
        made.add(round(seconds * S), speed)
    return made


def test_a_speed_holds_until_the_next_one():
    speeds = track((0.0, 1.0), (0.5, 3.0))
    assert speeds.distance(0, S) == pytest.approx(0.5 * 1.0 + 0.5 * 3.0)


def test_parts_add_up_to_the_whole():
    samples = [(0.1 * index, float(index % 5)) for index in range(30)]
    whole = track(*samples).distance(S, 2 * S)
    speeds = track(*samples)
    parts = [speeds.distance(S + 7 * step, S + 7 * (step + 1)) for step in range(S // 7 // 100)]
    assert None not in parts
    cuts = [S + S * index // 33 for index in range(34)]
    speeds = track(*samples)
    assert sum(map(speeds.distance, cuts, cuts[1:])) == pytest.approx(whole)


def test_the_first_speed_holds_for_what_was_just_before_it():
    assert track((0.05, 4.0)).distance(0, TENTH) == pytest.approx(0.4)
    assert track((2.6, 4.0)).distance(0, 3 * S) is None


@pytest.mark.parametrize('samples', [[], [(5.0, 1.0)], [(-2.6, 1.0)], [(0.0, 1.0), (3.0, 1.0)]])
def test_nothing_is_made_of_speeds_that_do_not_hold(samples):
    assert track(*samples).distance(0, 4 * S if len(samples) > 1 else TENTH) is None


def test_one_speed_a_second_is_enough():
    rng = np.random.default_rng(0)
    speeds = track(*((index + rng.uniform(-0.1, 0.1), 8.0) for index in range(60)))
    ways = [speeds.distance(index * TENTH, (index + 1) * TENTH) for index in range(600)]
    assert None not in ways
    assert sum(ways) == pytest.approx(480)


def test_equal_stamps_and_any_order_when_sorted():
    samples = sorted([(0.0, 1.0), (0.05, 3.0)] * 3)
    assert track(*samples).distance(0, TENTH) == pytest.approx(0.05 + 0.15)


def test_reversing_goes_back():
    assert track((0.0, -2.0)).distance(0, TENTH) == pytest.approx(-0.2)


def test_a_stamp_that_goes_back_starts_anew():
    speeds = track((10.0, 5.0), (0.0, 1.0))
    assert speeds.distance(0, TENTH) == pytest.approx(0.1)


@pytest.mark.parametrize('speed', [math.nan, math.inf, -math.inf, 1e200, -1000.1])
def test_a_speed_can_be_one(speed):
    speeds = track((0.0, 1.0))
    with pytest.raises(ValueError, match='speed is'):
        speeds.add(1, speed)
    assert speeds.distance(0, TENTH) == pytest.approx(0.1)


def test_it_stays_bounded_whether_it_is_asked_or_not():
    speeds = SpeedTrack(max_speeds=50)
    for stamp in range(0, 1000 * TENTH, TENTH // 10):
        speeds.add(stamp, 1.0)
        if stamp % TENTH == 0 and stamp > 500 * TENTH:
            assert speeds.distance(stamp - TENTH, stamp) == pytest.approx(0.1)
        assert len(speeds._stamps) <= 100
    assert speeds.newest_ns == stamp


def step(yaw, heading, *, deviation=0.001):
    return HeadingStep(yaw, yaw / 0.1, heading, False, deviation ** 2)


def gone(distance, *, share=0.05, **alike):
    return Travel(distance, (share * distance) ** 2, TravelState.MEASURED, **alike)


def test_a_quarter_circle():
    odometer, yaw = Odometer(), math.pi / 2 / 90
    radius = 10.0
    for index in range(1, 91):
        found = odometer.update(
            step(yaw, index * yaw), gone(radius * yaw), index * TENTH, 0.1)
    assert (found.pose.x, found.pose.y) == pytest.approx((radius, radius), rel=1e-3)
    assert found.pose.yaw == pytest.approx(math.pi / 2)
    assert found.speed == pytest.approx(radius * yaw / 0.1)
    assert found.yaw_rate == pytest.approx(yaw / 0.1)


def straight(pairs, **kwargs):
    odometer = Odometer()
    for index in range(1, pairs + 1):
        found = odometer.update(step(0.0, 0.0), gone(1.0, **kwargs), index * TENTH, 0.1)
    return np.array(found.covariance)


def test_independent_errors_grow_with_the_root_of_the_way_and_common_ones_with_the_way():
    assert math.sqrt(straight(100)[0, 0]) == pytest.approx(0.05 * 10.0)
    assert math.sqrt(straight(100, scale=0.05)[0, 0]) == pytest.approx(0.05 * 100.0)
    # Those that last for a second lie between.
    assert 0.05 * 20.0 < math.sqrt(straight(100, swing=0.05)[0, 0]) < 0.05 * 60.0


@given(st.lists(st.tuples(st.floats(-0.1, 0.1), st.floats(-3, 3)), min_size=1, max_size=30))
def test_covariances_are_ones(pairs):
    odometer, heading, before = Odometer(), 0.0, 0.0
    for index, (yaw, distance) in enumerate(pairs):
        heading += yaw
        now = odometer.update(
            step(yaw, heading), gone(distance, swing=0.02, tilt=0.03, scale=0.01),
            index * TENTH, 0.1)
        covariance = np.array(now.covariance)
        assert covariance == pytest.approx(covariance.T)
        assert np.linalg.eigvalsh(covariance).min() > -1e-9
        assert covariance[2, 2] == now.yaw_variance > 0.0
        assert np.trace(covariance[:2, :2]) / 2 == pytest.approx(now.position_variance)
        assert now.yaw_variance > before or yaw != 0.0
        before = now.yaw_variance


def test_the_covariance_is_what_drawn_errors_scatter_by():
    rng = np.random.default_rng(3)
    pairs, yaw, length = 60, math.radians(1.5), 0.8
    ends = []
    for _ in range(2000):
        scale = 1.0 + 0.04 * rng.normal()
        headings = np.cumsum(yaw + 0.004 * rng.normal(size=pairs))
        lengths = length * scale * (1.0 + 0.1 * rng.normal(size=pairs))
        middle = headings - np.diff(headings, prepend=0.0) / 2
        ends.append((*(lengths * (np.cos(middle), np.sin(middle))).sum(axis=1), headings[-1]))
    odometer = Odometer()
    # Without what is unknown here: the mounting, and angles that are wrong all alike.
    odometer._covariance[:] = 0.0
    for index in range(1, pairs + 1):
        travel = Travel(
            length, (0.04 ** 2 + 0.1 ** 2) * length ** 2, TravelState.MEASURED, scale=0.04)
        # Half of a yaw's variance is taken to last: with intervals so long, it does not.
        found = odometer.update(
            step(yaw, index * yaw, deviation=0.004), travel, index * 100 * S, 100.0)
    drawn, told = np.cov(np.array(ends).T), np.array(found.covariance)
    for row, column in ((0, 0), (1, 1), (2, 2), (0, 2)):
        scatter = math.sqrt(drawn[row, row] * drawn[column, column])
        assert told[row, column] == pytest.approx(drawn[row, column], abs=0.12 * scatter)


def test_what_is_not_known_of_the_way_is_an_error_of_the_pose():
    odometer, sure = Odometer(), Odometer()
    for each in (odometer, sure):
        each.update(step(0.0, 0.0), gone(1.0), TENTH, 0.1)
    for _ in range(30):
        odometer.miss(step(0.0, 0.0), Travel(0.0, 1.5 ** 2, TravelState.UNKNOWN), 0.1)
    lost = odometer.update(step(0.0, 0.0), gone(1.0), 40 * TENTH, 0.1)
    known = sure.update(step(0.0, 0.0), gone(1.0), 2 * TENTH, 0.1)
    assert lost.pose.x == known.pose.x == 2.0
    assert math.sqrt(lost.position_variance) > 30.0 > 2.0 > math.sqrt(known.position_variance)


def test_a_vehicle_that_stands_does_not_turn():
    driving, standing = Odometer(), Odometer()
    stood = Travel(0.0, 0.0, TravelState.STANDING)
    for index in range(100):
        drove = driving.update(step(0.0, 0.0), gone(1.0), index * TENTH, 0.1)
        stays = standing.update(step(0.0, 0.0), stood, index * TENTH, 0.1)
    assert stays.yaw_variance < 0.1 * drove.yaw_variance
    assert stays.position_variance == 0.0


def test_reset_goes_back_to_the_start():
    odometer = Odometer()
    first = odometer.update(step(0.1, 0.1), gone(1.0), TENTH, 0.1)
    odometer.update(step(0.1, 0.2), gone(1.0), 2 * TENTH, 0.1)
    odometer.reset()
    assert odometer.update(step(0.1, 0.1), gone(1.0), TENTH, 0.1) == first
