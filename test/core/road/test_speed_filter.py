# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
from phase_traj_ros.core.road.speed_filter import SpeedFilter
import pytest


def test_it_knows_nothing_at_first():
    speed_filter = SpeedFilter()
    assert not speed_filter.known
    low, high = speed_filter.bounds(0.0)
    assert low < 0.0 < 30.0 < high


def test_the_bounds_widen_with_the_time_that_passes_and_not_with_the_frames():
    once, often = SpeedFilter(), SpeedFilter()
    for speed_filter in (once, often):
        speed_filter.add(10.0, 0.01)
        speed_filter.add(10.0, 0.01)
    once.pass_time(1.0)
    for _ in range(20):
        often.pass_time(0.05)
    assert often.bounds(0.0) == pytest.approx(once.bounds(0.0))
    low, high = once.bounds(0.0)
    # Hard braking, 8 m/s2 with a camera 1.65 m above the road, is within them.
    assert low < 10.0 - 8.0 / 1.65 and high > 10.0 + 8.0 / 1.65


def test_a_speed_over_an_unsure_time_is_unsure():
    speed_filter = SpeedFilter()
    speed_filter.add(10.0, 0.01)
    speed_filter.pass_time(0.1, unsure=0.04)
    low, high = speed_filter.bounds(0.0)
    assert low <= 0.0 and high >= 20.0


def test_after_long_anything_may_be():
    speed_filter = SpeedFilter()
    speed_filter.add(10.0, 0.01)
    speed_filter.pass_time(60.0)
    assert speed_filter.bounds(0.0) == SpeedFilter().bounds(0.0)


def test_measurements_narrow_it():
    speed_filter = SpeedFilter()
    for _ in range(20):
        speed_filter.pass_time(0.1)
        speed_filter.add(8.0, 0.04)
    assert speed_filter.speed == pytest.approx(8.0)
    assert 0.0 < speed_filter.deviation <= 0.2


def test_a_first_pair_a_microsecond_apart_is_no_speed():
    speed_filter = SpeedFilter()
    speed_filter.add(4e4, 1e8)
    assert speed_filter.speed <= 45.0
    speed_filter.pass_time(0.1)
    assert speed_filter.lost


@pytest.mark.parametrize('speed', [0.0, 44.0])
def test_the_bounds_stay_within_what_vehicles_do(speed):
    speed_filter = SpeedFilter()
    speed_filter.add(speed, 0.01)
    speed_filter.pass_time(2.0)
    low, high = speed_filter.bounds(0.0)
    anything = SpeedFilter().bounds(0.0)
    assert anything[0] <= low <= speed <= high <= anything[1]
    assert max(speed - low, high - speed) == pytest.approx(3.0 * speed_filter.deviation)


def test_what_no_vehicle_can_do_is_not_searched():
    """A compressed road shows slides that do: 3 g are 18 camera heights per second squared."""
    speed_filter = SpeedFilter()
    for _ in range(20):
        speed_filter.pass_time(0.1)
        speed_filter.add(7.4, 0.6 ** 2)
    speed_filter.pass_time(0.1)
    speed_filter.pass_time(0.1)
    low, high = speed_filter.bounds(0.0)
    assert 7.4 - low < 18.0 * 0.2 and high - 7.4 < 18.0 * 0.2
    # Emergency braking, 9 m/s2, is found.
    assert low < 7.4 - 5.5 * 0.2


def test_an_unsure_measurement_may_be_as_far_off_as_both_together():
    """Not as far as one after the other: what is wrong would follow each time."""
    speed_filter = SpeedFilter()
    speed_filter.add(8.0, 0.3 ** 2)
    assert speed_filter.bounds(0.4) == pytest.approx((8.0 - 3.0 * 0.5, 8.0 + 3.0 * 0.5))


def test_a_first_speed_that_nothing_confirms_is_forgotten():
    alone, confirmed, standing = SpeedFilter(), SpeedFilter(), SpeedFilter()
    alone.add(0.5, 0.01)
    confirmed.add(0.5, 0.01)
    confirmed.add(0.6, 0.01)
    standing.stand(0.1)
    for speed_filter in (alone, confirmed, standing):
        speed_filter.pass_time(0.4)
        speed_filter.pass_time(0.4)
        # The speed may still be confirmed by this pair.
        assert speed_filter.known
        speed_filter.pass_time(0.4)
    assert not alone.known and alone.lost
    assert confirmed.known and standing.known
