# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
from phase_traj_ros.core.road.pace import Pace
import pytest


def test_it_knows_nothing_at_first():
    pace = Pace()
    assert not pace.known
    low, high = pace.bounds
    assert low < 0.0 < 30.0 < high


def test_the_bounds_widen_with_the_time_that_passes_and_not_with_the_frames():
    once, often = Pace(), Pace()
    for pace in (once, often):
        pace.add(10.0, 0.01)
    once.pass_time(1.0)
    for _ in range(20):
        often.pass_time(0.05)
    assert often.bounds == pytest.approx(once.bounds)
    low, high = once.bounds
    # Hard braking, 8 m/s2 with a camera 1.65 m above the road, is within them.
    assert low < 10.0 - 8.0 / 1.65 and high > 10.0 + 8.0 / 1.65


def test_a_speed_over_an_unsure_time_is_unsure():
    pace = Pace()
    pace.add(10.0, 0.01)
    pace.pass_time(0.1, unsure=0.04)
    low, high = pace.bounds
    assert low <= 0.0 and high >= 20.0


def test_after_long_anything_may_be():
    pace = Pace()
    pace.add(10.0, 0.01)
    pace.pass_time(60.0)
    assert pace.bounds == Pace().bounds


def test_measurements_narrow_it():
    pace = Pace()
    for _ in range(20):
        pace.pass_time(0.1)
        pace.add(8.0, 0.04)
    assert pace.speed == pytest.approx(8.0)
    assert 0.0 < pace.deviation <= 0.2


def test_a_first_pair_a_microsecond_apart_is_no_speed():
    pace = Pace()
    pace.add(4e4, 1e8)
    assert pace.speed <= 45.0
    pace.pass_time(0.1)
    assert pace.lost


@pytest.mark.parametrize('speed', [0.0, 44.0])
def test_the_bounds_stay_within_what_vehicles_do(speed):
    pace = Pace()
    pace.add(speed, 0.01)
    pace.pass_time(2.0)
    low, high = pace.bounds
    anything = Pace().bounds
    assert anything[0] <= low <= speed <= high <= anything[1]
    assert max(speed - low, high - speed) == pytest.approx(4.0 * pace.deviation)
