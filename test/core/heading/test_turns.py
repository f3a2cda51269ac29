# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Turns as a driver would count them."""

from dataclasses import astuple
from itertools import accumulate, pairwise
import math

from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core.heading.turns import find_turns, Turn, TurnDetector
import pytest

PERIOD_NS = 100_000_000
START_NS = 1_700_000_000_000_000_000
STRAIGHT = [0.0] * 20


def bend(angle, seconds, rate_hz=10):
    pairs = round(seconds * rate_hz)
    return [angle / pairs] * pairs


def turns_of(yaws_deg, period_ns=PERIOD_NS, **options):
    headings = [0.0, *accumulate(map(math.radians, yaws_deg))]
    stamps = [START_NS + index * period_ns for index in range(len(headings))]
    return find_turns(stamps, headings, **options)


def angles(yaws_deg, **options):
    return [round(turn.angle_deg, 3) for turn in turns_of(yaws_deg, **options)]


@pytest.mark.parametrize(('plan', 'expected'), [
    (STRAIGHT, []),
    ([*STRAIGHT, *bend(90, 3), *STRAIGHT], [90]),
    ([*STRAIGHT, *bend(-90, 3), *STRAIGHT], [-90]),
    ([*bend(90, 3), *STRAIGHT, *bend(-90, 3)], [90, -90]),
    # However large, it is one.
    ([*STRAIGHT, *bend(180, 5), *STRAIGHT], [180]),
    ([*STRAIGHT, *bend(-720, 20), *STRAIGHT], [-720]),
    # However slow.
    ([*STRAIGHT, *bend(90, 120), *STRAIGHT], [90]),
    # Too little, or back again.
    ([*STRAIGHT, *bend(59, 3), *STRAIGHT], []),
    ([*STRAIGHT, *bend(59, 60), *STRAIGHT], []),
    ([*STRAIGHT, *bend(50, 3), *bend(-50, 3), *STRAIGHT], []),
    # An S of two turns is two turns.
    ([*STRAIGHT, *bend(80, 3), *bend(-80, 3), *STRAIGHT], [80, -80]),
    # A wait of a second at the crossing makes two of it, and each of them is too small.
    ([*bend(45, 2), *[0.0] * 10, *bend(45, 2)], []),
])
def test_what_is_a_turn(plan, expected):
    assert angles(plan) == pytest.approx(expected)


def test_everything_of_a_turn():
    plan = [*[0.01] * 20, 1.0, *[3.0] * 29, 6.0, 1.0, *STRAIGHT]
    (turn,) = turns_of(plan)
    assert (turn.start_frame, turn.end_frame) == (20, 52)
    assert turn.start_ns == START_NS + 20 * PERIOD_NS
    assert turn.end_ns == START_NS + 52 * PERIOD_NS
    assert turn.angle_deg == pytest.approx(95.0)
    assert turn.peak_rate_deg_s == pytest.approx(60.0)
    assert turn.quarter_turns == 1


@pytest.mark.parametrize(('angle', 'quarters'), [
    (60, 1), (134, 1), (136, 2), (180, 2), (-60, -1), (-136, -2), (-360, -4), (44, 0)])
def test_quarter_turns(angle, quarters):
    assert Turn(0, 1, 0, 1, float(angle), 0.0).quarter_turns == quarters


@pytest.mark.parametrize('dip', [
    [0.0], [-4.0], [0.0] * 5, [-0.5] * 5, [0.2, -3.0, 0.2], [40.0, -37.0]])
def test_dips_and_wrong_pairs_do_not_end_a_turn(dip):
    plan = [*STRAIGHT, *bend(45, 1.5), *dip, *bend(45, 1.5), *STRAIGHT]
    (turn,) = turns_of(plan)
    assert turn.angle_deg == pytest.approx(90 + sum(dip))
    assert (turn.start_frame, turn.end_frame) == (20, 50 + len(dip))


def test_a_longer_dip_ends_it():
    assert angles([*STRAIGHT, *bend(90, 3), *[0.0] * 6, *bend(90, 3)]) == [90, 90]
    assert angles([*STRAIGHT, *bend(90, 3), *[0.0] * 5, *bend(90, 3)]) == [180]


@pytest.mark.parametrize('rate_hz', [1, 2, 5, 10, 30, 60])
def test_does_not_depend_on_the_frame_rate(rate_hz):
    plan = [*[0.0] * 2 * rate_hz, *bend(90, 4, rate_hz), *[0.0] * 2 * rate_hz]
    (turn,) = turns_of(plan, period_ns=1_000_000_000 // rate_hz)
    assert turn.angle_deg == pytest.approx(90)
    assert (turn.end_ns - turn.start_ns) / 1e9 == pytest.approx(4.0, rel=1e-6)
    assert turn.peak_rate_deg_s == pytest.approx(22.5, rel=1e-6)


def driven(plan, *, speed, rate_hz, noise_deg=0.0, seed=1):
    """Return the turns along a plan (degrees, heights), and the newest direction error."""
    ends = [0.0, *accumulate(way for _, way in plan)]
    headings = [0.0, *accumulate(angle for angle, _ in plan)]
    frames = round(ends[-1] / speed * rate_hz) + 1
    rng = np.random.default_rng(seed)
    detector, turns = TurnDetector(), []
    for frame in range(frames):
        way = frame * speed / rate_hz
        heading = np.interp(way, ends, headings) + rng.normal(0.0, noise_deg)
        turns += detector.update(
            START_NS + round(frame * 1e9 / rate_hz), math.radians(heading), speed / rate_hz)
    aside = detector.direction_error_deg
    return [*turns, *detector.finish()], aside


CORNER = [(0, 20), (90, 10), (0, 20)]


@pytest.mark.parametrize(('speed', 'rate_hz'), [
    (0.5, 5), (1.0, 30), (6.0, 5), (6.0, 60), (20.0, 10), (20.0, 120)])
@pytest.mark.parametrize(('plan', 'expected'), [
    (CORNER, [1]),
    # A long bend, a running track, and a motorway junction.
    ([(0, 30), (90, 150), (0, 60)], [1]),
    ([(0, 60), (180, 700), (0, 200), (180, 700), (0, 60)], [2, 2]),
    ([(0, 50), (-270, 200), (0, 50)], [-3]),
    # Corners next to each other are turns of their own.
    ([(0, 20), (90, 8), (0, 6), (90, 8), (0, 6), (-90, 8), (0, 20)], [1, 1, -1]),
    # A bend that is not steady is one.
    ([(0, 30), (30, 40), (0, 8), (60, 80), (0, 60)], [1]),
    # An S, and a road that is almost straight, turn nobody around.
    ([(0, 20), (40, 20), (-40, 20), (40, 20), (-40, 20), (0, 20)], []),
    ([(40, 1000)], [])])
def test_turns_depend_on_the_way_alone(plan, expected, speed, rate_hz):
    found, _ = driven(plan, speed=speed, rate_hz=rate_hz, noise_deg=0.1)
    assert [turn.quarter_turns for turn in found] == expected


def test_a_stop_in_a_corner_does_not_end_its_turn():
    detector = TurnDetector()
    frames = [(0.0, 0.5)] * 20 + [(3.0, 0.5)] * 15 + [(0.0, 0.0)] * 300 + [(3.0, 0.5)] * 15
    heading, turns = 0.0, detector.update(0, 0.0)
    for frame, (yaw, way) in enumerate([*frames, *[(0.0, 0.5)] * 20], 1):
        heading += yaw
        turns += detector.update(frame * PERIOD_NS, math.radians(heading), way)
    assert [turn.angle_deg for turn in turns] == pytest.approx([90.0])


def test_a_drive_as_a_whole_has_the_turns_along_its_way():
    # The second half of a corner follows a straight of the length of a bus, and of a street.
    headings = np.radians(np.concatenate([np.zeros(10), np.linspace(0, 45, 10), np.full(20, 45.0),
                                          np.linspace(45, 90, 10), np.full(10, 90.0)]))
    stamps = START_NS + PERIOD_NS * np.arange(len(headings))
    for straight, angles in ((0.2, [90.0]), (40.0, [])):
        steps = np.ones(len(headings))
        steps[20:40] = straight / 20
        found = find_turns(stamps.tolist(), headings, (np.cumsum(steps) - 1.0).tolist())
        assert [turn.angle_deg for turn in found] == pytest.approx(angles)


def test_a_turn_on_the_spot_is_one():
    detector, turns = TurnDetector(), []
    for frame in range(301):
        turns += detector.update(frame * PERIOD_NS, math.radians(0.3 * frame), 0.0)
    for frame in range(301, 311):
        turns += detector.update(frame * PERIOD_NS, math.radians(90.0), 0.5)
    assert [turn.angle_deg for turn in turns] == pytest.approx([90.0])


@pytest.mark.parametrize('side', [1, -1])
def test_turns_to_both_sides_on_the_spot_are_three(side):
    yaws = [side * yaw for yaw in [-6.0] * 60 + [6.0] * 15 + [-6.0] * 60]
    headings = np.radians(np.cumsum([0.0, *yaws])).tolist()
    detector, turns, quarters = TurnDetector(), [], []
    for frame, heading in enumerate(headings):
        turns += detector.update(frame * PERIOD_NS, heading, 0.0)
        quarters += detector.quarters
    turns += detector.finish()
    assert [turn.angle_deg for turn in turns] == pytest.approx(
        [-360.0 * side, 90.0 * side, -360.0 * side])
    assert all(one.end_frame <= other.start_frame for one, other in pairwise(turns))
    assert sum(quarters) == -7 * side


@pytest.mark.parametrize(('plan', 'aside'), [
    (CORNER, 0.0), ([(0, 20), (50, 10), (0, 50)], 50.0),
    # Two bends of 50 degrees, each too small for a turn, make more than a right angle.
    ([(0, 20), (50, 10), (0, 50), (50, 10), (0, 50)], 100.0),
    ([(0, 20), (130, 10), (0, 50)], 40.0), ([(0, 20), (50, 10)], 0.0)])
def test_the_direction_may_be_aside_of_the_heading(plan, aside):
    _, found = driven(plan, speed=5.0, rate_hz=10)
    assert found == pytest.approx(aside)


def test_a_turn_that_is_not_over_counts_at_the_end():
    assert angles([*STRAIGHT, *bend(70, 2)]) == [70]
    assert angles([*STRAIGHT, *bend(50, 2)]) == []


def test_is_told_half_a_second_after_its_end():
    detector, heading, told = TurnDetector(), 0.0, []
    for frame, yaw in enumerate([0.0, *STRAIGHT, *bend(90, 3), *STRAIGHT]):
        heading += math.radians(yaw)
        for turn in detector.update(START_NS + frame * PERIOD_NS, heading):
            told.append((frame, turn))
    ((frame, turn),) = told
    assert turn.end_frame == 50
    assert frame - turn.end_frame == 7
    assert detector.finish() == []


@given(st.lists(st.floats(-8.0, 8.0), max_size=150))
def test_online_and_offline_find_the_same(yaws):
    headings = [0.0, *accumulate(map(math.radians, yaws))]
    detector, found = TurnDetector(), []
    for frame, heading in enumerate(headings):
        found += detector.update(START_NS + frame * PERIOD_NS, heading)
    found += detector.finish()
    assert sorted(found, key=lambda turn: turn.start_frame) == turns_of(yaws)


@given(st.lists(st.floats(-8.0, 8.0), max_size=150))
def test_turns_are_what_they_say(yaws):
    headings = [0.0, *accumulate(yaws)]
    turns = turns_of(yaws)
    for turn in turns:
        assert 0 <= turn.start_frame < turn.end_frame < len(headings)
        net = headings[turn.end_frame] - headings[turn.start_frame]
        assert turn.angle_deg == pytest.approx(net, abs=1e-6)
        assert abs(turn.angle_deg) >= 60 - 1e-6
        side = math.copysign(1, turn.peak_rate_deg_s)
        # Its first and its last pair turn to its side.
        for pair in (turn.start_frame, turn.end_frame - 1):
            assert side * yaws[pair] > 0.0
    for side in (1, -1):
        same = [turn for turn in turns if turn.peak_rate_deg_s * side > 0]
        assert all(one.end_frame <= two.start_frame for one, two in pairwise(same))


@given(st.lists(st.floats(-8.0, 8.0), max_size=100))
def test_mirrored_drives_have_mirrored_turns(yaws):
    mirrored = turns_of([-yaw for yaw in yaws])
    assert [astuple(turn)[:4] for turn in mirrored] == [
        astuple(turn)[:4] for turn in turns_of(yaws)]
    assert [-turn.angle_deg for turn in mirrored] == pytest.approx(
        [turn.angle_deg for turn in turns_of(yaws)])


def test_the_definition_can_be_changed():
    plan = [*STRAIGHT, *bend(57, 3), *STRAIGHT]
    assert angles(plan, min_angle_deg=55.0) == [57]
    for wrong in (0.0, math.nan):
        with pytest.raises(ValueError, match='finite number above 0'):
            TurnDetector(min_angle_deg=wrong)


def counted(plan, *, scale_at=None, factor=1.0):
    """Return the quarters of each pair of a drive, and the turns; all is scaled at one pair."""
    detector = TurnDetector()
    detector.update(START_NS, 0.0)
    heading, scaled, quarters, turns = 0.0, 1.0, [], []
    for pair, yaw in enumerate(plan, 1):
        if pair == scale_at:
            detector.scale(factor)
            heading *= factor
            scaled = factor
        heading += math.radians(yaw) * scaled
        turns += detector.update(START_NS + pair * PERIOD_NS, heading)
        quarters.append(detector.quarters)
    return quarters, turns


def test_quarters_count_while_the_turn_goes_on():
    quarters, _ = counted([*STRAIGHT, *bend(-202, 5), *STRAIGHT])
    assert [(pair, each) for pair, each in enumerate(quarters, 1) if each] == [
        (35, (-1,)), (54, (-1,))]


def test_a_turn_to_the_other_side_takes_nothing_back():
    quarters, _ = counted([*STRAIGHT, *bend(90, 3), *bend(-40, 2), *STRAIGHT, *bend(-80, 3)])
    assert [each for each in quarters if each] == [(1,), (-1,)]


def test_bends_that_turn_out_to_have_been_turns_count_late_and_in_their_order():
    # Measured with half the angles: none of them is a turn, until that is known.
    plan = [
        *STRAIGHT, *bend(-45, 3), *STRAIGHT, *bend(90, 3), *STRAIGHT, *bend(20, 2), *STRAIGHT,
        *bend(-50, 3), *[0.0] * 40]
    before, nothing = counted(plan)
    assert [each for each in before if each] == [(1,)]
    assert [turn.angle_deg for turn in nothing] == pytest.approx([90])
    quarters, turns = counted(plan, scale_at=len(plan) - 9, factor=2.0)
    assert [(pair, each) for pair, each in enumerate(quarters, 1) if each][1:] == [
        (len(plan) - 9, (-1, 1, -1))]
    # What was told before stays as it was.
    assert sorted(turn.angle_deg for turn in turns) == pytest.approx([-100, -90, 90])


def test_a_bend_becomes_a_turn_only_once():
    plan = [*STRAIGHT, *bend(90, 3), *[0.0] * 40]
    detector, heading, turns = TurnDetector(), 0.0, []
    detector.update(START_NS, 0.0)
    for pair, yaw in enumerate(plan, 1):
        if factor := {70: 0.5, 73: 2.0}.get(pair):
            detector.scale(factor)
            heading *= factor
        heading += math.radians(yaw)
        turns += detector.update(START_NS + pair * PERIOD_NS, heading)
    assert [turn.angle_deg for turn in [*turns, *detector.finish()]] == pytest.approx([90])


def test_a_scale_that_makes_turns_smaller_takes_nothing_back():
    plan = [*STRAIGHT, *bend(90, 3), *[0.0] * 30]
    quarters, turns = counted(plan, scale_at=60, factor=0.5)
    assert [each for each in quarters if each] == [(1,)]
    assert len(turns) == 1


def test_a_turn_under_way_goes_on_with_the_new_scale():
    plan = [*STRAIGHT, *bend(45, 3), *[0.0] * 20]
    quarters, turns = counted(plan, scale_at=40, factor=2.0)
    assert [each for each in quarters if each] == [(1,)]
    assert [turn.angle_deg for turn in turns] == pytest.approx([90])
    assert turns[0].peak_rate_deg_s == pytest.approx(30)


@pytest.mark.parametrize('pairs_after', range(1, 12))
def test_a_turn_counts_wherever_the_scale_comes_after_it(pairs_after):
    # Half a second after its last pair it is over: that may be the very next one.
    plan = [*STRAIGHT, *bend(-45, 3), *[0.0] * 20]
    quarters, turns = counted(plan, scale_at=15 + 30 + pairs_after, factor=2.0)
    assert [each for each in quarters if each] == [(-1,)]
    assert [turn.angle_deg for turn in turns] == pytest.approx([-90])
    assert [turn.peak_rate_deg_s for turn in turns] == pytest.approx([-30])
