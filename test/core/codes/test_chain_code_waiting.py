# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The state machine with confirmation and release of turns over several pairs."""

from itertools import groupby

from hypothesis import given, strategies as st
from phase_traj_ros.core import Direction, DynamicChainCode, Movement
import pytest

L, F, R, N = Movement
T = 16.0
SKIP, END = 'skip', 'end'

LEFT = st.sampled_from([T, 2 * T])
STRAIGHT = st.sampled_from([0.0, 1e-9 - T, T - 1e-9])
SHIFT = st.sampled_from([-2 * T, -T, 1e-9 - T, 0.0, T - 1e-9, T, 2 * T])
PAIRS = st.lists(
    st.sampled_from([-2 * T, -T, 0.0, T - 1e-9, T, 2 * T, SKIP, END]), max_size=40)
FRAMES = st.integers(1, 6)


def feed(codes, pairs):
    return [
        codes.skip(end_turn=each is END) if each in (SKIP, END) else codes.update(each)
        for each in pairs]


def run(pairs, *, confirm=1, release=1):
    codes = DynamicChainCode(T, confirm_frames=confirm, release_frames=release)
    return codes, feed(codes, pairs)


def movements(pairs, **options):
    return [step.movement for step in run(pairs, **options)[1]]


def turns(steps):
    return [step.movement for step in steps if step.movement in (L, R)]


def papers_movements(pairs):
    """Run an independent implementation of the paper's state machine."""
    said, before, first = [], 'forward', True
    for each in pairs:
        if each in (SKIP, END):
            said.append(N)
            before = 'forward' if each is END else before
            continue
        now = 'left' if each >= T else 'right' if each <= -T else 'forward'
        if first:
            now = 'forward'
        said.append(
            F if now == 'forward' else N if now == before else {'left': L, 'right': R}[now])
        before, first = now, False
    return said


@given(PAIRS)
def test_with_one_and_one_it_is_the_papers(pairs):
    assert movements(pairs) == papers_movements(pairs)


@given(PAIRS, FRAMES, FRAMES)
def test_lengths_and_heading_always_add_up(pairs, confirm, release):
    codes, steps = run(pairs, confirm=confirm, release=release)
    assert list(codes.movement) == [step.movement for step in steps]
    assert len(codes.movement) == len(pairs)
    assert len(codes.direction) == len(pairs) - codes.movement.totals_of(Movement)[N]
    assert list(codes.direction) == [step.direction for step in steps if step.appended]
    assert codes.heading == (1 + sum(turn - 1 for turn in turns(steps))) % 4


@given(PAIRS, FRAMES, FRAMES)
def test_waiting_never_adds_a_turn(pairs, confirm, release):
    waited = run(pairs, confirm=confirm, release=release)[1]
    assert len(turns(waited)) <= len(turns(run(pairs)[1]))


@given(PAIRS, FRAMES, FRAMES)
def test_mirrored_shifts_give_mirrored_codes(pairs, confirm, release):
    mirrored = [each if each in (SKIP, END) else -each for each in pairs]
    assert movements(mirrored, confirm=confirm, release=release) == [
        {L: R, R: L}.get(each, each)
        for each in movements(pairs, confirm=confirm, release=release)]


@given(st.lists(SHIFT, min_size=1, max_size=30), st.lists(st.booleans(), max_size=30),
       FRAMES, FRAMES)
def test_skipped_pairs_do_not_change_what_the_others_say(pairs, skips, confirm, release):
    skips += [False] * (len(pairs) - len(skips))
    mixed = [each for pair, skip in zip(pairs, skips) for each in ([SKIP] * skip + [pair])]
    said = movements(mixed, confirm=confirm, release=release)
    assert [code for code, pair in zip(said, mixed) if pair != SKIP] == movements(
        pairs, confirm=confirm, release=release)


@given(PAIRS, PAIRS, FRAMES, FRAMES)
def test_after_a_skip_that_ends_the_turn_nothing_is_left_of_it(before, after, confirm, release):
    said = movements([0.0, *before, END, *after], confirm=confirm, release=release)
    fresh = movements([0.0, *after], confirm=confirm, release=release)
    assert said[2 + len(before):] == fresh[1:]


@given(st.integers(2, 6), st.data())
def test_fewer_wrong_pairs_do_not_end_a_turn(release, data):
    wrong = st.lists(SHIFT, min_size=1, max_size=release - 1)
    good = st.lists(LEFT, min_size=1, max_size=4)
    parts = data.draw(st.lists(st.tuples(good, wrong), min_size=1, max_size=8))
    turn = [dx for good_part, wrong_part in parts for dx in (*good_part, *wrong_part)]
    _, steps = run([0.0, T, *turn, T], release=release)
    assert [step.movement for step in steps] == [F, L, *[N] * (len(turn) + 1)]


@given(st.integers(2, 6), st.data())
def test_shorter_swerves_are_not_turns(confirm, data):
    swerve = st.lists(LEFT, min_size=1, max_size=confirm - 1)
    straight = st.lists(STRAIGHT, min_size=1, max_size=4)
    parts = data.draw(st.lists(st.tuples(swerve, straight), max_size=8))
    pairs = [dx for swerve_part, straight_part in parts for dx in (*swerve_part, *straight_part)]
    said = movements([0.0, *pairs], confirm=confirm)
    assert said == [F, *(F if abs(dx) < T else N for dx in pairs)]


@given(st.lists(st.integers(-3, 3).map(lambda times: times * T), max_size=60), FRAMES)
def test_a_turn_counts_once_it_has_lasted(shifts, confirm):
    said = movements([0.0, *shifts], confirm=confirm)[1:]
    end = 0
    for side, stretch in groupby(shifts, key=lambda dx: (dx > 0) - (dx < 0)):
        begin, end = end, end + len(list(stretch))
        turn = {1: L, -1: R}.get(side)
        expected = [F] * (end - begin)
        if turn is not None:
            expected = [N] * (end - begin)
            expected[confirm - 1:confirm] = [turn] * (end - begin >= confirm)
        assert said[begin:end] == expected


@pytest.mark.parametrize(('options', 'shifts', 'codes'), [
    # It ends on the third pair below the threshold, which is judged afresh: forward ...
    ({'release': 3}, [20, 20, 0, 0, 0, 0], [L, N, N, N, F, F]),
    # ... the opposite turn ...
    ({'release': 3}, [20, 20, 0, 0, -20, -20], [L, N, N, N, R, N]),
    # ... the opposite turn, confirmed by then ...
    ({'release': 3, 'confirm': 2}, [20, 20, -20, -20, -20, 0], [N, L, N, N, R, N]),
    # ... or one that is still to be confirmed.
    ({'release': 3, 'confirm': 2}, [20, 20, 0, 0, -20, -20], [N, L, N, N, N, R]),
    ({'release': 3, 'confirm': 2}, [20, 20, 0, 0, -20, 0], [N, L, N, N, N, F]),
    # One pair that continues the turn restarts the count.
    ({'release': 3}, [20, 0, 0, 20, 0, 0, 0], [L, N, N, N, N, N, F]),
    # Also in the turn after a turn.
    ({'release': 2}, [20, 0, 0, 20, 0, 20, 0, 0], [L, N, F, L, N, N, N, F]),
    # A swerve to the other side is not a confirmation.
    ({'confirm': 2}, [20, -20, 20, -20, -20, 0], [N, N, N, N, R, F]),
    # Neither are pairs that are not consecutive.
    ({'confirm': 2}, [20, 0, 20, 0, 20, 20], [N, F, N, F, N, L]),
])
def test_codes_pair_by_pair(options, shifts, codes):
    assert movements([0.0, *shifts], **options)[1:] == codes


def test_the_first_pair_confirms_nothing():
    assert movements([50, 50, 50], confirm=2) == [F, N, L]


def test_the_current_turn_is_known_while_it_waits():
    codes, _ = run([0, 20], confirm=2)
    assert codes.turn is None
    codes.update(20)
    assert codes.turn is L
    codes, _ = run([0, 20, 0], release=2)
    assert codes.turn is L
    codes.update(0)
    assert codes.turn is None


def test_new_settings_hold_from_the_next_pair_on():
    codes, _ = run([0, 20, 0, 0], release=9)
    codes.configure(T, release_frames=3)
    assert codes.update(0).movement is F
    codes.configure(T, confirm_frames=2, release_frames=3)
    assert [step.movement for step in feed(codes, [20, 20])] == [N, L]
    assert codes.heading is Direction.BACKWARD


@pytest.mark.parametrize('name', ['confirm_frames', 'release_frames'])
@pytest.mark.parametrize('value', [0, -3])
def test_less_than_one_pair_is_refused(name, value):
    with pytest.raises(ValueError, match=name):
        DynamicChainCode(T, **{name: value})
    codes, _ = run([0])
    with pytest.raises(ValueError, match=name):
        codes.configure(T, **{name: value})
    assert [step.movement for step in feed(codes, [20, 0])] == [L, F]
