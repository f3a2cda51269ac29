# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The way from speeds, and the odometry from heading and way."""

import math

from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.path.odometry import Odometer
from phase_traj_ros.core.path.speed import SpeedTrack
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


def step(yaw, heading, *, bridged=False):
    return HeadingStep(yaw, yaw / 0.1, heading, bridged)


def test_a_quarter_circle():
    odometer, yaw = Odometer(), math.pi / 2 / 90
    radius = 10.0
    for index in range(1, 91):
        found = odometer.update(
            step(yaw, index * yaw), radius * yaw, index * TENTH, 0.1)
    assert (found.pose.x, found.pose.y) == pytest.approx((radius, radius), rel=1e-3)
    assert found.pose.yaw == pytest.approx(math.pi / 2)
    assert found.speed == pytest.approx(radius * yaw / 0.1)
    assert found.yaw_rate == pytest.approx(yaw / 0.1)


@given(st.lists(st.tuples(st.floats(-0.1, 0.1), st.floats(-3, 3), st.booleans()), min_size=1))
def test_variances_never_shrink_and_bridged_pairs_count_more(pairs):
    odometer, heading, before = Odometer(), 0.0, None
    for index, (yaw, distance, bridged) in enumerate(pairs):
        heading += yaw
        now = odometer.update(
            step(yaw, heading, bridged=bridged), distance, index * TENTH, 0.1)
        if before is not None:
            assert now.yaw_variance > before.yaw_variance
            assert now.position_variance >= before.position_variance
        assert now.yaw_rate_variance > 0
        before = now
    measured = Odometer().update(step(0.0, 0.0), 1.0, TENTH, 0.1)
    missing = Odometer().update(step(0.0, 0.0, bridged=True), 1.0, TENTH, 0.1)
    assert missing.yaw_variance > measured.yaw_variance


def test_what_is_not_known_of_the_way_is_an_error_of_the_pose():
    odometer, sure = Odometer(), Odometer()
    for each in (odometer, sure):
        each.update(step(0.0, 0.0), 1.0, TENTH, 0.1)
    for _ in range(30):
        odometer.miss(step(0.0, 0.0), 0.1)
    lost = odometer.update(step(0.0, 0.0), 1.0, 40 * TENTH, 0.1)
    known = sure.update(step(0.0, 0.0), 1.0, 2 * TENTH, 0.1)
    assert lost.pose.x == known.pose.x == 2.0
    assert math.sqrt(lost.position_variance) > 30.0 > 2.0 > math.sqrt(known.position_variance)


def test_reset_goes_back_to_the_start():
    odometer = Odometer()
    first = odometer.update(step(0.1, 0.1), 1.0, TENTH, 0.1)
    odometer.update(step(0.1, 0.2), 1.0, 2 * TENTH, 0.1)
    odometer.reset()
    assert odometer.update(step(0.1, 0.1), 1.0, TENTH, 0.1) == first
