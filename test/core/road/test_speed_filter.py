# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
from itertools import pairwise
import math

import numpy as np
from phase_traj_ros.core.road.speed_filter import SpeedFilter
from phase_traj_ros.core.road.travel import Travel, TravelState
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
    once.predict(1.0)
    for _ in range(20):
        often.predict(0.05)
    assert often.bounds(0.0) == pytest.approx(once.bounds(0.0))
    low, high = once.bounds(0.0)
    # Hard braking, 8 m/s2 with a camera 1.65 m above the road, is within them.
    assert low < 10.0 - 8.0 / 1.65 and high > 10.0 + 8.0 / 1.65


def test_a_speed_over_an_unsure_time_is_unsure():
    speed_filter = SpeedFilter()
    speed_filter.add(10.0, 0.01)
    speed_filter.predict(0.1, interval_deviation=0.04)
    low, high = speed_filter.bounds(0.0)
    assert low <= 0.0 and high >= 20.0


def test_jitter_of_the_stamps_is_no_change_of_the_speed():
    """Each interval is up to 30 % too long or too short; the speed is constant."""
    rng, speed_filter = np.random.default_rng(7), SpeedFilter()
    off = rng.uniform(-0.005, 0.005, 200)
    errors = []
    for before, after in pairwise(off):
        interval = 0.033 + after - before
        speed_filter.predict(interval, interval_deviation=float(np.std(np.diff(off))))
        low, high = speed_filter.bounds(0.3)
        seen = 15.0 * 0.033 / interval
        assert low < seen < high
        speed_filter.add(seen, 0.3 ** 2)
        errors.append(speed_filter.speed - 15.0)
    # The speeds that are seen scatter by 2.
    assert np.std(errors[20:]) < 0.7


def test_a_first_speed_over_a_wrong_interval_is_replaced_by_the_second():
    speed_filter = SpeedFilter()
    # The first of the stamps was 0.4 s early.
    for interval, deviation in ((0.433, 0.144), (0.033, 0.144), (0.033, 0.144)):
        speed_filter.predict(interval, interval_deviation=deviation)
        low, high = speed_filter.bounds(0.1)
        assert low < 5.5 < high
        speed_filter.add(5.5 * 0.033 / interval, 0.1 ** 2)
    speed_filter.predict(0.033)
    low, high = speed_filter.bounds(0.1)
    assert low < 5.5 < high
    assert speed_filter.speed == pytest.approx(5.5)


def test_a_lost_speed_may_exceed_the_largest_one_over_a_short_interval():
    speed_filter = SpeedFilter()
    speed_filter.predict(0.02, interval_deviation=0.04)
    assert speed_filter.bounds(0.0)[1] == pytest.approx(3.0 * SpeedFilter().bounds(0.0)[1])


def test_after_long_anything_may_be():
    speed_filter = SpeedFilter()
    speed_filter.add(10.0, 0.01)
    speed_filter.predict(60.0)
    assert speed_filter.bounds(0.0) == SpeedFilter().bounds(0.0)


def test_measurements_narrow_it():
    speed_filter = SpeedFilter()
    for _ in range(20):
        speed_filter.predict(0.1)
        speed_filter.add(8.0, 0.04)
    assert speed_filter.speed == pytest.approx(8.0)
    assert 0.0 < speed_filter.deviation <= 0.2


def test_a_first_pair_a_microsecond_apart_is_no_speed():
    speed_filter = SpeedFilter()
    speed_filter.add(4e4, 1e8)
    assert speed_filter.speed <= 45.0
    speed_filter.predict(0.1)
    assert speed_filter.lost


@pytest.mark.parametrize('speed', [0.0, 44.0])
def test_the_bounds_stay_within_what_vehicles_do(speed):
    speed_filter = SpeedFilter()
    speed_filter.add(speed, 0.01)
    speed_filter.predict(2.0)
    low, high = speed_filter.bounds(0.0)
    # Seen to reverse, any speed back; else a slow one.
    seen, unseen = (SpeedFilter().bounds(0.0, reverses=reverses) for reverses in (True, False))
    assert seen[0] <= low <= speed <= high <= unseen[1] == -seen[0]
    assert seen[1] == 0.0 and unseen[0] == -1.5 <= low
    farthest = 3.0 * speed_filter.deviation
    assert speed_filter.bounds(0.0, reverses=True)[0] == pytest.approx(speed - farthest)
    assert max(speed - low, high - speed) == pytest.approx(farthest)


def test_what_no_vehicle_can_do_is_not_searched():
    """A compressed road shows slides that do: 3 g are 18 camera heights per second squared."""
    speed_filter = SpeedFilter()
    for _ in range(20):
        speed_filter.predict(0.1)
        speed_filter.add(7.4, 0.6 ** 2)
    speed_filter.predict(0.1)
    speed_filter.predict(0.1)
    low, high = speed_filter.bounds(0.0)
    assert 7.4 - low < 18.0 * 0.2 and high - 7.4 < 18.0 * 0.2
    # Emergency braking, 9 m/s2, is found.
    assert low < 7.4 - 5.5 * 0.2


def test_an_unsure_measurement_may_be_as_far_off_as_both_together():
    """Not as far as one after the other: what is wrong would follow each time."""
    speed_filter = SpeedFilter()
    speed_filter.add(8.0, 0.3 ** 2)
    assert speed_filter.bounds(0.4) == pytest.approx((8.0 - 3.0 * 0.5, 8.0 + 3.0 * 0.5))


@pytest.mark.parametrize(('now', 'refuted'), [
    (20.0, 0.5), (14.4, 0.5), (14.3, 0.0), (8.0, 0.0), (3.4, 0.0), (3.2, 0.5)])
def test_a_speed_that_cannot_be_reached_refutes_those_so_far(now, refuted):
    """
    At 6 heights/s2, it takes the 0.2 s since the last one and the 0.5 s of a profile.

    A profile does not tell speeds apart that differ by 15 %.
    """
    speeds = SpeedFilter()
    speeds.add(8.0, 0.0)
    for _ in range(3):
        speeds.predict(0.1)
        speeds.add(8.0, 0.0)
    speeds.predict(0.2)
    assert speeds.refuted_by(now, 0.5) == pytest.approx(refuted)
    # A profile of a second may be 3 heights/s behind.
    assert speeds.refuted_by(14.4, 1.0) == 0.0


def test_only_speeds_that_may_be_noise_are_refuted():
    speeds = SpeedFilter()
    speeds.predict(1.0)
    assert speeds.refuted_by(20.0, 0.5) == 0.0
    speeds.add(5.0, 0.01)
    speeds.predict(0.1)
    assert speeds.refuted_by(20.0, 0.5) == pytest.approx(0.1)
    speeds.add(5.0, 0.01, clear=True)
    speeds.predict(0.1)
    assert speeds.refuted_by(20.0, 0.5) == 0.0
    # A vehicle that stood is sure to have done so.
    speeds.forget()
    speeds.stand(0.1)
    speeds.predict(0.1)
    assert speeds.refuted_by(20.0, 0.5) == 0.0
    speeds.forget()
    speeds.add(5.0, 0.01)
    speeds.predict(10.0)
    assert speeds.lost and speeds.refuted_by(40.0, 0.5) == 0.0


def test_a_first_speed_that_nothing_confirms_is_forgotten():
    alone, confirmed, standing = SpeedFilter(), SpeedFilter(), SpeedFilter()
    alone.add(0.5, 0.01)
    confirmed.add(0.5, 0.01)
    confirmed.add(0.6, 0.01)
    standing.stand(0.1)
    for speed_filter in (alone, confirmed, standing):
        speed_filter.predict(0.4)
        speed_filter.predict(0.4)
        # The speed may still be confirmed by this pair.
        assert speed_filter.known
        speed_filter.predict(0.4)
    assert not alone.known and alone.lost
    assert confirmed.known and standing.known


def test_a_distance_at_the_last_speed_scatters_as_it_says():
    """With drawn errors of the speed, and of the pitch, from which the last one came."""
    rng = np.random.default_rng(5)
    measured = Travel(1.0, 0.1, TravelState.MEASURED, 0.03, 0.04)
    errors, shared = [], []
    for _ in range(2000):
        speed = 8.0 + 0.3 * rng.normal()
        swing, tilt = 0.03 * rng.normal(), 0.04 * rng.normal()
        speed_filter = SpeedFilter()
        speed_filter.add(8.0, 0.3 ** 2)
        bridged = speed_filter.bridge(0.5, measured)
        errors.append(bridged.distance - speed * 0.5 * (1.0 + swing + tilt))
        shared.append((speed - 8.0) / 8.0 + swing)
    assert bridged.state is TravelState.BRIDGED
    assert np.std(errors) == pytest.approx(math.sqrt(bridged.variance), rel=0.08)
    # What goes wrong with the speed goes on for about as long as the springs swing.
    assert bridged.swing == pytest.approx(np.std(shared), rel=0.08)
    assert bridged.tilt == 0.04
    assert bridged.own_variance == pytest.approx(0.0, abs=1e-9)


def test_a_vehicle_that_turns_does_not_stand():
    speed_filter, measured = SpeedFilter(), Travel(0.0, 0.0, TravelState.STANDING)
    speed_filter.stand(0.1)
    speed_filter.predict(0.1)
    still = speed_filter.bridge(0.1, measured)
    assert (still.distance, still.state) == (0.0, TravelState.BRIDGED)
    assert speed_filter.bridge(0.1, measured, turns=True).state is TravelState.UNKNOWN
    speed_filter.add(3.0, 0.01)
    assert speed_filter.bridge(0.1, measured, turns=True).state is TravelState.BRIDGED


def test_the_last_speed_bridges_seconds_and_no_more():
    speed_filter, measured = SpeedFilter(), Travel(0.0, 0.0, TravelState.MEASURED)
    speed_filter.add(8.0, 0.01)
    assert speed_filter.bridge(2.0, measured).distance == pytest.approx(16.0)
    assert speed_filter.bridge(60.0, measured).distance < 8.0 * 3.0
    speed_filter.predict(60.0)
    lost = speed_filter.bridge(0.3, measured)
    # The drawn path goes on, but nobody knows how far.
    assert lost.state is TravelState.UNKNOWN and lost.distance == pytest.approx(2.4)
    assert math.sqrt(lost.variance) == pytest.approx(0.3 * SpeedFilter().deviation)


@pytest.mark.parametrize('interval', [0.02, 0.5])
def test_without_a_speed_a_pair_is_one_unit_and_any_distance(interval):
    speed_filter = SpeedFilter()
    unknown = speed_filter.bridge(interval, Travel(0.0, 0.0, TravelState.UNKNOWN))
    assert (unknown.distance, unknown.state) == (1.0, TravelState.UNKNOWN)
    assert math.sqrt(unknown.variance) == pytest.approx(interval * speed_filter.deviation)


def test_a_speed_is_as_sure_as_its_measurements():
    """Against drawn errors of a constant speed; the last one counts by its share."""
    rng, errors = np.random.default_rng(6), []
    for _ in range(2000):
        speed_filter = SpeedFilter()
        for deviation in (0.5, 0.2, 0.3):
            speed_filter.add(8.0 + deviation * rng.normal(), deviation ** 2)
        errors.append((speed_filter.speed - 8.0) / speed_filter.deviation)
    assert np.std(errors) == pytest.approx(1.0, abs=0.08)
