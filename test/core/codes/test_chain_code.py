# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's state machine."""

from itertools import groupby, product

from hypothesis import given, strategies as st
from phase_traj_ros.core import Direction, DynamicChainCode, Movement
import pytest

L, F, R, N = Movement
T = 16.0

# The paper's printed movement streams, code x count; docs/explanation/method.md is about their
# lengths.
TABLE_1 = [(1, 23), (2, 1), (3, 7), (1, 69), (2, 1), (3, 8), (1, 128)]
TABLE_2 = [(1, 23), (0, 1), (3, 7), (1, 68), (2, 1), (3, 7), (1, 23), (2, 1), (3, 7), (1, 53)]


def run(shifts, threshold=T):
    codes = DynamicChainCode(threshold)
    return codes, [codes.update(dx) for dx in shifts]


def facing(direction):
    """Return a started chain code with this direction."""
    codes = DynamicChainCode(T)
    codes.update(0)
    for _ in range((direction - Direction.FORWARD) % 4):
        codes.update(-T)
        codes.update(0)
    assert codes.heading is direction
    return codes


@pytest.mark.parametrize(('direction', 'movement'), product(Direction, (L, F, R)))
def test_every_direction_and_movement(direction, movement):
    codes = facing(direction)
    step = codes.update({L: T, F: 0.0, R: -T}[movement])
    turned = (direction + {L: -1, F: 0, R: 1}[movement]) % 4
    assert (step.movement, step.direction, step.appended) == (movement, turned, True)
    assert list(codes.direction)[-1] == turned


@pytest.mark.parametrize('direction', Direction)
def test_no_change_keeps_every_direction_and_appends_nothing(direction):
    codes = facing(direction)
    before = len(codes.direction)
    step = codes.skip()
    assert (step.movement, step.direction, step.appended) == (N, direction, False)
    assert len(codes.direction) == before


def test_the_papers_worked_examples():
    left_of_left = facing(Direction.LEFT)
    assert left_of_left.update(T).direction is Direction.BACKWARD
    right_of_right = facing(Direction.RIGHT)
    assert right_of_right.update(-T).direction is Direction.BACKWARD


@pytest.mark.parametrize('dx', [0.0, 500.0, -500.0])
def test_the_first_pair_is_forward_whatever_its_shift(dx):
    codes, (step,) = run([dx])
    assert (step.movement, step.direction) == (F, Direction.FORWARD)
    assert (len(codes.movement), len(codes.direction)) == (1, 1)


def test_the_threshold_itself_is_a_turn():
    _, steps = run([0, T - 1e-9, T, T, T - 1e-9, -T + 1e-9, -T, -T, -T + 1e-9])
    assert [step.movement for step in steps] == [F, F, L, N, F, F, R, N, F]


def test_a_turn_is_counted_once_however_long():
    codes, steps = run([0, 40, 50, 60, 50, 16, 0])
    assert [step.movement for step in steps] == [F, L, N, N, N, N, F]
    assert list(codes.direction) == [1, 0, 0]


def test_a_turn_can_be_followed_by_the_opposite_turn_at_once():
    _, steps = run([0, 20, 20, -20, -20, 20])
    assert [step.movement for step in steps] == [F, L, N, R, N, L]


def test_a_skipped_pair_keeps_the_turn_and_can_end_it():
    codes, _ = run([0, 20])
    assert codes.turn is L
    codes.skip()
    assert codes.update(20).movement is N
    codes.skip(end_turn=True)
    assert codes.turn is None
    assert codes.heading is Direction.LEFT
    assert codes.update(20).movement is L


def test_a_skipped_pair_is_not_the_first():
    codes = DynamicChainCode(T)
    assert codes.skip().movement is N
    assert codes.update(100).movement is F


@pytest.mark.parametrize('threshold', [0.0, -1.0, float('nan'), float('inf'), -float('inf')])
def test_threshold_has_to_be_finite_and_positive(threshold):
    with pytest.raises(ValueError, match='threshold'):
        DynamicChainCode(threshold)
    codes = DynamicChainCode(T)
    with pytest.raises(ValueError, match='threshold'):
        codes.configure(threshold)
    assert codes.threshold == T


@pytest.mark.parametrize('dx', [float('nan'), float('inf')])
def test_a_shift_has_to_be_finite(dx):
    codes, _ = run([0])
    with pytest.raises(ValueError, match='skip'):
        codes.update(dx)
    assert len(codes.movement) == 1


SHIFT = st.floats(-100, 100) | st.sampled_from([T, -T, 0.0]) | st.none()
SHIFTS = st.lists(SHIFT, max_size=60)


def drive(shifts, threshold=T):
    codes = DynamicChainCode(threshold)
    steps = [
        codes.skip(end_turn=index % 2 == 0) if dx is None else codes.update(dx)
        for index, dx in enumerate(shifts)]
    return codes, steps


@given(SHIFTS)
def test_lengths_always_add_up(shifts):
    codes, steps = drive(shifts)
    assert len(codes.movement) == len(shifts)
    assert list(codes.movement) == [step.movement for step in steps]
    assert len(codes.direction) == len(codes.movement) - codes.movement.totals_of(Movement)[N]
    assert list(codes.direction) == [step.direction for step in steps if step.appended]


@given(SHIFTS)
def test_the_heading_is_the_sum_of_the_turns(shifts):
    codes, steps = drive(shifts)
    turns = sum({L: -1, R: 1}.get(step.movement, 0) for step in steps)
    assert codes.heading == (Direction.FORWARD + turns) % 4


@given(SHIFTS)
def test_mirrored_shifts_give_mirrored_codes(shifts):
    _, steps = drive(shifts)
    _, mirrored = drive([None if dx is None else -dx for dx in shifts])
    mirror = {L: R, R: L, F: F, N: N}
    assert [step.movement for step in mirrored] == [mirror[step.movement] for step in steps]
    assert [step.direction for step in mirrored] == [
        Direction((2 - step.direction) % 4) for step in steps]


@given(st.lists(st.floats(-100, 100), max_size=60), st.floats(0.01, 100))
def test_only_the_ratio_of_shift_and_threshold_counts(shifts, scale):
    _, steps = drive(shifts)
    powers = 2.0 ** round(scale)  # a power of two scales without rounding
    _, scaled = drive([dx * powers for dx in shifts], T * powers)
    assert scaled == steps


@given(st.lists(st.floats(-100, 100), min_size=1, max_size=60))
def test_a_long_turn_never_counts_twice(shifts):
    _, steps = drive(shifts)
    for turn, side in ((L, 1), (R, -1)):
        stretches = [
            beyond for beyond, _ in groupby([dx * side >= T for dx in shifts[1:]]) if beyond]
        assert sum(step.movement is turn for step in steps) == len(stretches)


@pytest.mark.parametrize('threshold', [12.0, 16.0, 20.0, 60.0])
@pytest.mark.parametrize(('table', 'directions'), [(TABLE_1, [1, 2, 3]), (TABLE_2, [1, 0, 1, 2])])
def test_shifts_that_follow_the_papers_streams_reproduce_them(table, directions, threshold):
    shifts, turn = [], 0.0
    for code, count in table:
        turn = {0: threshold, 1: 0.0, 2: -threshold, 3: turn}[code]
        shifts += [turn * 1.5] * count
    codes, _ = run(shifts, threshold)
    assert [(run.code, run.count) for run in codes.movement.runs] == table
    assert [run.code for run in codes.direction.runs] == directions
