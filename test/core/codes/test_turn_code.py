# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Codes from quarter turns."""

from itertools import accumulate
import math

from hypothesis import given, strategies as st
from phase_traj_ros.core import Direction, Movement
from phase_traj_ros.core.codes.from_turns import TurnCode
from phase_traj_ros.core.heading.turns import TurnDetector
import pytest

L, F, R, N = Movement
SECOND = 1_000_000_000
STRAIGHT = [0.0] * 15


def bend(angle, pairs=30):
    return [angle / pairs] * pairs


def coded(yaws_deg, skipped=()):
    """Return the codes of a drive at 10 Hz, given by the degrees of each pair."""
    codes, turns = TurnCode(), TurnDetector()
    turns.update(0, 0.0)
    for pair, heading in enumerate(accumulate(map(math.radians, yaws_deg))):
        turns.update((pair + 1) * SECOND // 10, heading)
        if pair in skipped:
            codes.expect(turns.quarters)
            codes.skip()
        else:
            codes.update(turns.quarters, math.radians(yaws_deg[pair]) * 10)
    return codes


def changes(codes):
    return [code for code in codes.movement if code in (L, R)]


@pytest.mark.parametrize(('plan', 'expected', 'heading'), [
    (STRAIGHT, [], Direction.FORWARD),
    ([*STRAIGHT, *bend(90), *STRAIGHT], [L], Direction.LEFT),
    ([*STRAIGHT, *bend(-90), *STRAIGHT], [R], Direction.RIGHT),
    # A wrong field of view is tolerated to some degree, and a bend is not a turn.
    ([*STRAIGHT, *bend(72), *STRAIGHT, *bend(-108), *STRAIGHT], [L, R], Direction.FORWARD),
    ([*STRAIGHT, *bend(58), *STRAIGHT], [], Direction.FORWARD),
    # Two codes for a U-turn, four for a circle, in the order of the drive.
    ([*STRAIGHT, *bend(180, 50), *STRAIGHT, *bend(-90), *STRAIGHT], [L, L, R], Direction.LEFT),
    ([*STRAIGHT, *bend(-360, 90), *STRAIGHT], [R] * 4, Direction.FORWARD),
    # An unfinished turn at the end counts as far as it goes.
    ([*STRAIGHT, *bend(-70)], [R], Direction.RIGHT),
])
def test_quarters_of_turns_are_the_codes(plan, expected, heading):
    codes = coded(plan)
    assert changes(codes) == expected
    assert codes.heading is heading
    assert len(codes.movement) == len(plan)
    assert len(codes.direction) == len(plan) - list(codes.movement).count(N)


def test_a_quarter_is_coded_on_the_pair_that_completes_it():
    movement = list(coded([*STRAIGHT, *bend(180, 60), *STRAIGHT]).movement)
    # Three degrees a pair: a quarter from 60 degrees on, two from 135 degrees on.
    assert [pair for pair, code in enumerate(movement) if code is L] == pytest.approx(
        [15 + 20, 15 + 45], abs=1)
    assert movement[:15] == [F] * 15 and movement[-10:] == [F] * 10
    assert set(movement[16:34]) == {N}


def test_the_first_pair_is_forward_whatever_it_is():
    codes = TurnCode()
    assert codes.update((-1, -1), -2.0).movement is F
    # Its quarters are coded by the next pairs, one each.
    assert [codes.update((), 0.0).movement for _ in range(3)] == [R, R, F]
    assert codes.heading is Direction.BACKWARD


def test_turns_to_both_sides_that_count_at_once_are_coded_in_their_order():
    codes = TurnCode()
    codes.update((), 0.0)
    assert [codes.update((-1, 1), 0.0).movement, codes.update((), 0.0).movement] == [R, L]
    assert list(codes.direction) == [Direction.FORWARD, Direction.RIGHT, Direction.FORWARD]


@pytest.mark.parametrize('skipped', [range(15, 45), range(34, 37), range(1, 60)])
def test_pairs_skipped_during_a_turn_lose_nothing(skipped):
    plan = [*STRAIGHT, *bend(90), *STRAIGHT, *STRAIGHT]
    codes = coded(plan, skipped)
    assert changes(codes) == [L]
    assert codes.heading is Direction.LEFT
    assert all(list(codes.movement)[pair] is N for pair in skipped)


@given(
    st.lists(
        st.sampled_from([0, 90, -90, 180, -180, 30, -50, 360]), min_size=1, max_size=6),
    st.data())
def test_lengths_and_headings_add_up(angles, data):
    plan = [yaw for angle in angles for yaw in (*bend(angle, 50), *STRAIGHT, *STRAIGHT)]
    plan = [*plan, *STRAIGHT]
    skipped = data.draw(st.sets(st.integers(0, len(plan) - 16)))
    codes = coded(plan, skipped)
    movement = list(codes.movement)
    assert len(movement) == len(plan)
    assert len(codes.direction) == len(movement) - movement.count(N)
    quarters = [int(angle / 90) for angle in angles if abs(angle) >= 60]
    assert changes(codes) == [L if count > 0 else R for count in quarters for _ in range(
        abs(count))]
    assert list(codes.direction)[-1:] == ([codes.heading] if codes.direction else [])
