# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The way from speeds."""

import math

import numpy as np
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
    parts = [speeds.distance(S + 7 * step, S + 7 * (step + 1)) for step in range(10_000)]
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
