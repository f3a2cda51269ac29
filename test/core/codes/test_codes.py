# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Movement and direction codes, packing, runs."""

from hypothesis import given, strategies as st
from phase_traj_ros.core import CodeSeries, Direction, Movement, pack, Run, unpack
import pytest

CODES = st.lists(st.integers(0, 3))


@given(CODES)
def test_unpack_gives_back_what_was_packed(codes):
    packed = pack(codes)
    assert len(packed) == -(-len(codes) // 4)
    assert unpack(packed, len(codes)) == codes


def test_packing_is_pinned():
    assert pack([0, 1, 2, 3]) == bytes([0b00011011])
    assert pack([3]) == bytes([0b11000000])
    assert pack([Movement.RIGHT, Movement.NO_CHANGE, 3, 3, 1]) == bytes([0b10111111, 0b01000000])


@pytest.mark.parametrize('code', [-1, 4, 255])
def test_pack_refuses_invalid_codes(code):
    with pytest.raises(ValueError, match='position 1'):
        pack([0, code])


@pytest.mark.parametrize('count', [-1, 0, 5, 9])
def test_unpack_refuses_a_count_that_does_not_fit(count):
    with pytest.raises(ValueError, match='bytes'):
        unpack(b'\x1b', count)


@pytest.mark.parametrize(('before', 'after'), [(0, 3), (1, 0), (2, 1), (3, 2)])
def test_left_turns(before, after):
    assert Direction(before).turned_left() is Direction(after)
    assert Direction(after).turned_right() is Direction(before)


@given(CODES, st.integers(1, 6))
def test_a_bounded_series_keeps_the_newest_runs_and_all_totals(codes, max_runs):
    bounded, whole = CodeSeries(max_runs=max_runs), CodeSeries()
    for code in codes:
        bounded.append(Movement(code))
        whole.append(Movement(code))
    assert list(whole) == codes
    assert bounded.runs == whole.runs[-max_runs:] == whole.last_runs(max_runs)
    assert len(bounded) == len(codes)
    assert bounded.totals_of(Movement) == tuple(map(codes.count, sorted(Movement)))


def test_runs_are_maximal():
    series = CodeSeries()
    for code in (1, 1, 2, 3, 3, 3, 1):
        series.append(Movement(code))
    assert series.runs == (
        Run(Movement.FORWARD, 2), Run(Movement.RIGHT, 1), Run(Movement.NO_CHANGE, 3),
        Run(Movement.FORWARD, 1))


def test_series_needs_room_for_a_run():
    with pytest.raises(ValueError, match='max_runs'):
        CodeSeries(max_runs=0)
