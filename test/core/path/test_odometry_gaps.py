# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The odometry where yaw or distance are not measured."""

import math

import numpy as np
from odometry_pairs import gone, step, TENTH
from phase_traj_ros.core.heading.tracker import HeadingStep, HeadingTracker
from phase_traj_ros.core.path.heading_path import HeadingPath
from phase_traj_ros.core.path.odometry import Odometer
from phase_traj_ros.core.road.travel import Travel, TravelState
import pytest

S = 10**9


@pytest.mark.parametrize('rate_hz', [10, 30])
@pytest.mark.parametrize('seconds', [0.3, 0.7, 1.5])
def test_a_correction_after_a_covered_lens_is_no_motion(rate_hz, seconds):
    """The lens is covered while a turn begins."""
    interval, tracker, odometer = 1.0 / rate_hz, HeadingTracker(), Odometer(HeadingPath())
    covered = range(rate_hz, rate_hz + round(seconds * rate_hz))
    top = min(60.0 * seconds, 40.0)
    rates = [0.0] * rate_hz + np.linspace(0, top, len(covered)).tolist() + [top] * rate_hz
    for index, rate in enumerate(rates):
        yaw = None if index in covered else math.radians(rate) * interval
        turned = tracker.update(yaw, interval, variance=math.radians(0.02) ** 2)
        found = odometer.update(
            turned, gone(8.0 * interval), round((index + 1) * interval * S), interval)
        off = abs(found.yaw_rate - math.radians(rate))
        assert off < 3.0 * math.sqrt(found.yaw_rate_variance)
        if not turned.bridged:
            assert found.yaw_rate == pytest.approx(math.radians(rate))
            assert math.sqrt(found.yaw_rate_variance) < 0.1
    off = abs(found.pose.yaw - math.radians(sum(rates)) * interval)
    assert off < 3.0 * math.sqrt(found.covariance[2][2])
    assert seconds > 1.0 or off < 0.05


def test_what_is_not_known_of_the_way_is_an_error_of_the_pose():
    odometer, sure = Odometer(HeadingPath()), Odometer(HeadingPath())
    for each in (odometer, sure):
        each.update(step(0.0, 0.0), gone(1.0), TENTH, 0.1)
    for _ in range(30):
        odometer.update(
            step(0.0, 0.0), Travel(0.0, 1.5 ** 2, TravelState.UNKNOWN), TENTH, 0.1)
    lost = odometer.update(step(0.0, 0.0), gone(1.0), 40 * TENTH, 0.1)
    known = sure.update(step(0.0, 0.0), gone(1.0), 2 * TENTH, 0.1)
    assert lost.pose.x == known.pose.x == 2.0
    # It may have been in one direction, in all pairs.
    assert math.sqrt(lost.covariance[0][0]) == pytest.approx(30 * 1.5, rel=0.01)
    assert math.sqrt(known.covariance[0][0]) < 2.0


def test_the_speed_after_a_gap_tells_how_far_a_vehicle_may_have_gone_in_it():
    """A robot that drives 0.3 m/s was not 15 m/s fast a tenth of a second before."""
    odometer, deviations = Odometer(HeadingPath()), []
    for speed, gap in ((0.3, 0.1), (0.3, 0.1), (0.3, 2.0), (-10.0, 0.1)):
        missed = Travel(0.0, (15.0 * gap) ** 2, TravelState.UNKNOWN)
        odometer.update(step(0.0, 0.0, deviation=0.0), missed, TENTH, gap)
        found = odometer.update(
            step(0.0, 0.0, deviation=0.0), gone(0.1 * speed, share=0.0), TENTH, 0.1)
        deviations.append(math.sqrt(found.covariance[0][0]))
    # What is missing is missing in one direction, so that gaps add up.
    once, twice, long, fast = np.diff([0.0, *deviations])
    assert 0.03 < once < 0.1 and twice == pytest.approx(once, rel=0.01)
    assert 2 * 0.3 + 3.0 < long < 15.0 * 2.0
    assert 1.0 < fast < 1.5


def test_a_pair_that_is_missed_turns_but_goes_nowhere():
    odometer = Odometer(HeadingPath())
    before = odometer.update(step(0.0, 0.0), gone(1.0), TENTH, 0.1)
    odometer.update(step(0.3, 0.3), Travel(5.0, 0.0, TravelState.UNKNOWN), 2 * TENTH, 0.1)
    after = odometer.update(step(0.0, 0.3), gone(0.0), 3 * TENTH, 0.1)
    assert (after.pose.x, after.pose.y, after.pose.yaw) == pytest.approx(
        (before.pose.x, before.pose.y, 0.3))
    assert np.array(after.covariance)[:2, :2] == pytest.approx(
        np.array(before.covariance)[:2, :2])
    assert after.covariance[2][2] > before.covariance[2][2]


def test_a_rate_is_the_less_sure_the_longer_nothing_is_measured():
    odometer, deviations = Odometer(HeadingPath()), []
    for pair in range(1, 31):
        found = odometer.update(
            HeadingStep(0.0, 0.0, 0.0, True), Travel(1.0, 0.01, TravelState.BRIDGED),
            pair * TENTH, 0.1)
        deviations.append(math.degrees(math.sqrt(found.yaw_rate_variance)))
    # A car begins a corner with 20 degrees per second squared, and has at most 30 per second.
    assert np.diff(deviations[:10]) == pytest.approx([2.0] * 9)
    assert deviations[-1] == pytest.approx(30.0)
    # A measured pair ends it.
    odometer.update(step(0.0, 0.0), gone(1.0), 31 * TENTH, 0.1)
    again = odometer.update(HeadingStep(0.0, 0.0, 0.0, True), gone(1.0), 32 * TENTH, 0.1)
    assert math.degrees(math.sqrt(again.yaw_rate_variance)) == pytest.approx(deviations[0])


@pytest.mark.parametrize('interval', [0.05, 0.5, 2.0])
def test_the_rate_of_a_bridged_pair_is_its_yaw_over_its_time(interval):
    """The heading went on at 0.2 rad/s; the tracker's own rate may differ, which is uncertain."""
    def rate(tracked):
        step = HeadingStep(0.2 * interval, tracked, 0.2 * interval, True)
        travel = Travel(1.0, 0.01, TravelState.BRIDGED)
        found = Odometer(HeadingPath()).update(step, travel, S, interval)
        return found.yaw_rate, found.yaw_rate_variance

    (same, sure), (other, unsure) = rate(0.2), rate(0.5)
    assert same == other == pytest.approx(0.2)
    assert unsure == pytest.approx(sure + 0.3 ** 2)
    assert math.radians(5.0) ** 2 < sure <= math.radians(30.0) ** 2
