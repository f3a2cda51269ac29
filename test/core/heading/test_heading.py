# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Adding up yaw, and bridging what is missing or cannot be."""

import math

from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core.heading.tracker import HeadingTracker
import pytest


def follow(yaws, interval=0.1):
    tracker = HeadingTracker()
    return tracker, [tracker.update(yaw, interval) for yaw in yaws]


def test_adds_up_yaw_to_the_left():
    tracker, steps = follow([0.01, 0.02, -0.005])
    assert tracker.heading == pytest.approx(0.025)
    assert steps[1].rate == pytest.approx(0.2)
    assert [step.heading for step in steps] == pytest.approx([0.01, 0.03, 0.025])
    assert not any(step.bridged for step in steps)
    assert (tracker.pairs, tracker.bridged, tracker.bridged_share) == (3, 0, 0.0)


def test_is_not_wrapped():
    tracker, _ = follow([0.1] * 100)
    assert tracker.heading == pytest.approx(10.0)


def test_a_missing_pair_gets_the_mean_rate_of_its_neighbours():
    tracker, steps = follow([0.02, None, 0.04])
    assert steps[1].bridged and not steps[2].bridged
    assert steps[1].yaw == pytest.approx(0.02, rel=0.1)
    assert tracker.heading == pytest.approx(0.02 + 0.03 + 0.04)
    assert tracker.bridged_share == pytest.approx(1 / 3)


def test_what_is_missing_for_long_fades_out():
    tracker, steps = follow([0.02] + [None] * 100)
    # By a factor of e each second, so that all of it is that of a second.
    assert tracker.heading == pytest.approx(0.02 + 0.2, abs=1e-4)
    assert steps[11].yaw == pytest.approx(steps[1].yaw / math.e)
    assert abs(steps[-1].yaw) < 1e-4
    # Another rate is admitted if a second pair confirms it. It lasted for a second before them,
    # in which the old rate still fades.
    assert tracker.update(0.3, 0.1).bridged
    assert not tracker.update(0.3, 0.1).bridged
    assert tracker.heading == pytest.approx(0.02 + 0.2 + 3.0 + 0.3 + 0.3)


def test_one_wild_pair_is_not_believed():
    tracker, steps = follow([0.02, 0.02, 0.35, 0.02, 0.02])
    assert [step.bridged for step in steps] == [False, False, True, False, False]
    assert tracker.heading == pytest.approx(0.1)


def test_a_jump_that_lasts_is_believed_and_made_up_for():
    tracker, steps = follow([0.0, 0.0, 0.3, 0.3, 0.3])
    assert [step.bridged for step in steps] == [False, False, True, False, False]
    assert tracker.heading == pytest.approx(0.9)


def test_two_wild_pairs_that_contradict_each_other_are_not_believed():
    tracker, steps = follow([0.0, 0.3, -0.3, 0.0])
    assert [step.bridged for step in steps] == [False, True, True, False]
    assert tracker.heading == pytest.approx(0.0)


def test_a_long_interval_allows_a_larger_change():
    tracker, steps = follow([0.0, 0.3], interval=0.5)
    assert not steps[1].bridged
    assert tracker.rate == pytest.approx(0.6)


def test_a_brisk_turn_is_believed():
    # 90 degrees in 1.6 seconds, with a rate that rises within 0.4 s.
    rates = [0.0, 0.2, 0.66, 1.12, *[1.31] * 9, 1.12, 0.66, 0.2, 0.0]
    _, steps = follow([rate / 10 for rate in rates])
    assert not any(step.bridged for step in steps)


@given(st.lists(st.one_of(st.none(), st.floats(-3.0, 3.0)), max_size=60),
       st.floats(0.01, 1.0))
def test_steps_add_up_and_only_missing_or_doubted_pairs_are_bridged(yaws, interval):
    tracker, steps = follow(yaws, interval)
    assert math.isclose(sum(step.yaw for step in steps), tracker.heading, abs_tol=1e-6)
    assert all(step.bridged for step, yaw in zip(steps, yaws) if yaw is None)
    assert tracker.bridged == sum(step.bridged for step in steps)
    assert all(math.isfinite(step.heading) and math.isfinite(step.rate) for step in steps)


@given(st.lists(st.floats(-0.02, 0.02), min_size=1, max_size=60))
def test_what_a_vehicle_can_do_is_never_bridged(yaws):
    tracker, steps = follow(yaws)
    assert not any(step.bridged for step in steps)
    assert math.isclose(tracker.heading, sum(yaws), abs_tol=1e-9)


def test_a_jump_beyond_doubt_is_believed_at_once():
    # As where every third frame was lost, and the stamps do not tell.
    yaws = [math.radians(3.5 if index % 3 else 7.5) for index in range(30)]
    sure, doubting = HeadingTracker(), HeadingTracker()
    for yaw in yaws:
        assert not sure.update(yaw, 0.1, certain=True).bridged
        doubting.update(yaw, 0.1)
    assert sure.heading == pytest.approx(sum(yaws))
    assert doubting.bridged > 0


def test_two_wild_pairs_confirm_each_other_only_within_what_a_vehicle_can_do():
    # From 3 to 4 rad/s within a tenth of a second: 570 degrees per second squared.
    _, steps = follow([0.0, 0.0, 0.3, 0.4, 0.0])
    assert [step.bridged for step in steps] == [False, False, True, True, False]


def test_a_missing_pair_before_a_jump_that_lasts_gets_the_mean_rate():
    tracker, steps = follow([0.02, None, 0.3, 0.3])
    assert [step.bridged for step in steps] == [False, True, True, False]
    assert tracker.heading == pytest.approx(0.02 + (0.02 + 0.3) / 2 + 0.3 + 0.3)


def test_wild_pairs_after_a_long_gap_are_not_followed():
    tracker, _ = follow([0.0, *[None] * 15])
    for yaw in (0.9, -0.3, 0.3, -0.2):
        assert tracker.update(yaw, 0.1).bridged
    assert tracker.heading == pytest.approx(0.0)


@pytest.mark.parametrize('interval', [1 / 30, 0.05, 0.0999, 0.1, 0.1001, 0.2])
def test_a_turn_that_begins_in_a_gap_is_made_up_for_at_any_rate(interval):
    # A second is where the bridged rate has faded.
    for seconds in (0.8, 0.95, 1.0, 1.05, 1.2):
        missing = round(seconds / interval)
        tracker, _ = follow([0.0, *[None] * missing], interval)
        step = tracker.update(0.7 * interval, interval, certain=True)
        assert tracker.heading == pytest.approx(0.7 * (missing / 2 + 1) * interval)
        # The turn may have begun at any time within the gap.
        assert step.missed == pytest.approx(0.7 * missing * interval / math.sqrt(12))


def test_the_deviation_of_the_heading_is_that_of_all_steps():
    tracker = HeadingTracker()
    for _ in range(25):
        tracker.update(0.01, 0.1, variance=0.002 ** 2)
    assert tracker.deviation == pytest.approx(5 * 0.002)
    bridged = [tracker.update(None, 0.1) for _ in range(15)]
    after = tracker.update(0.3, 0.1, variance=0.002 ** 2, certain=True)
    assert tracker.heading == pytest.approx(25 * 0.01 + (0.1 + 3.0) / 2 * 1.5 + 0.3)
    assert after.missed == pytest.approx((3.0 - 0.1) * 1.5 / math.sqrt(12))
    assert tracker.deviation == pytest.approx(math.sqrt(
        26 * 0.002 ** 2 + sum(step.variance for step in bridged) + after.missed ** 2))


def test_what_is_foreseen_is_as_uncertain_as_the_newest_pairs():
    tracker = HeadingTracker()
    tracker.update(0.02, 0.1, variance=0.002 ** 2)
    step = tracker.foresee(0.05, 0.001)
    assert (step.yaw, step.heading, step.rate) == pytest.approx((0.01, 0.03, 0.2))
    assert step.variance == pytest.approx(0.002 ** 2 / 2) and step.foreseen == 0.001
    assert not step.bridged
    assert tracker.heading == 0.02


def test_a_rate_from_before_a_cut_says_nothing_of_what_comes_after_it():
    tracker, _ = follow([0.1, 0.1])
    tracker.cut()
    assert tracker.rate == 0.0 and tracker.heading == pytest.approx(0.2)
    assert tracker.update(None, 0.1).yaw == 0.0
    tracker, _ = follow([0.1, None])
    tracker.cut()
    # Nothing of the gap is made up for.
    assert tracker.update(-0.3, 0.1).yaw == pytest.approx(-0.3)


def test_a_corrected_scale_holds_for_the_gap_and_the_rate():
    tracker, _ = follow([0.1, None])
    tracker.scale(1.5)
    twin, _ = follow([0.15, None])
    assert (tracker.heading, tracker.rate) == pytest.approx((twin.heading, twin.rate))
    assert tracker.update(0.2, 0.1).yaw == pytest.approx(twin.update(0.2, 0.1).yaw)
    tracker = HeadingTracker()
    tracker.update(0.1, 0.1, variance=0.01 ** 2)
    tracker.scale(1.5)
    assert tracker.deviation == pytest.approx(0.015)
    assert tracker.foresee(0.1, 0.0).variance == pytest.approx(0.015 ** 2)


def test_what_is_bridged_is_as_uncertain_at_any_frame_rate():
    found = []
    for rate_hz in (5, 10, 60):
        tracker = HeadingTracker()
        tracker.update(0.0, 1.0 / rate_hz)
        found.append(sum(
            tracker.update(None, 1.0 / rate_hz).variance for _ in range(2 * rate_hz)))
    assert found == pytest.approx([found[0]] * 3)
    assert math.degrees(math.sqrt(found[0])) > 5.0


def agile(rate_hz=20, seconds=40.0):
    """Return a tracker after swerves of 2 rad/s that begin and end within a tenth of a second."""
    tracker = HeadingTracker()
    for number in range(round(rate_hz * seconds)):
        turns = number / rate_hz % 0.8 > 0.4
        tracker.update(2.0 * turns / rate_hz, 1.0 / rate_hz, certain=True)
    tracker.update(0.0, 1.0 / rate_hz, certain=True)
    return tracker


def test_what_an_agile_vehicle_has_done_it_can_do_in_a_doubtful_pair():
    # 0 to 1.5 rad/s within 0.05 s: 1,700 degrees per second squared.
    assert not follow([0.0] * 400, interval=0.05)[0].admits(0.075, 0.05)
    tracker = agile()
    assert tracker.admits(0.075, 0.05) and not tracker.admits(0.5, 0.05)
    twin = agile()
    twin.scale(2.0)
    assert twin.admits(0.14, 0.05) and not tracker.admits(0.14, 0.05)
    # It is forgotten after two minutes of calm driving.
    for _ in range(2400):
        tracker.update(0.0, 0.05, certain=True)
    assert not tracker.admits(0.075, 0.05)


def test_doubtful_pairs_do_not_teach_how_agile_the_vehicle_is():
    tracker = HeadingTracker()
    for number in range(400):
        # Each jump lasts for two pairs, so that the second one confirms it.
        tracker.update(0.1 * (number // 2 % 2), 0.05)
    tracker.update(0.0, 0.05, certain=True)
    assert not tracker.admits(0.075, 0.05)


@pytest.mark.parametrize('rate_hz', [10, 20, 40])
def test_an_agile_vehicle_can_turn_far_while_nothing_is_measured(rate_hz):
    tracker = agile(rate_hz)
    before = tracker.deviation
    for _ in range(rate_hz // 2):
        tracker.update(None, 1.0 / rate_hz)
    gained = math.degrees(math.sqrt(tracker.deviation ** 2 - before ** 2))
    # A change of 2 rad/s every 0.4 s, for half a second.
    assert gained == pytest.approx(math.degrees(math.sqrt(4.0 / 0.4 / 3 * 0.5 ** 3)), rel=0.3)


@pytest.mark.parametrize(('count', 'apart'), [(2, 0.003), (4, 0.003), (1, 0.1)])
def test_stamps_that_jitter_or_come_in_bursts_are_no_agility(count, apart):
    random = np.random.default_rng(1)
    tracker = HeadingTracker()
    for _ in range(600 // count):
        intervals = [apart] * (count - 1) + [0.1 * count - apart * (count - 1)]
        for interval in intervals:
            interval += (count == 1) * random.uniform(-0.01, 0.01)
            tracker.update(math.radians(4.0), interval, certain=True)
    tracker.update(math.radians(4.0), 0.1, certain=True)
    assert not tracker.admits(math.radians(4.0 + 4.5), 0.1)
    # A calm vehicle with exact stamps: 2.5 degrees; the agile one above: 37.
    assert math.degrees(math.sqrt(sum(
        tracker.update(None, 0.1).variance for _ in range(5)))) < 4.0


def test_one_wild_pair_is_no_agility():
    tracker = HeadingTracker()
    for number in range(300):
        tracker.update(0.0 if number != 200 else 1.0, 0.1, certain=True)
    assert not tracker.admits(math.radians(5.0), 0.1)


def test_the_uncertainty_of_a_long_gap_grows_and_has_bounds():
    deviations = []
    for tracker in (agile(), HeadingTracker()):
        assert all(tracker.update(None, 0.1).variance > 0.0 for _ in range(600))
        deviations.append(math.degrees(tracker.deviation))
    assert deviations == pytest.approx([300.0] * 2, rel=0.1)
