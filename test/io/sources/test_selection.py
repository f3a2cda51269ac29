# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The frames selected by --start, --duration and --every."""

from hypothesis import given, strategies as st
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.sources.selection import Selection, Selector
import pytest

TENTH = 100_000_000


def selected(selection, stamps):
    """Return the indices of the selected frames."""
    selector = Selector(selection)
    return [index for index, stamp in enumerate(stamps) if selector.judge(stamp)]


TEN = [1_700_000_000_000_000_000 + index * TENTH for index in range(10)]


@pytest.mark.parametrize(('selection', 'expected'), [
    (Selection(), range(10)),
    (Selection(start=0.3), range(3, 10)),
    (Selection(start=0.31), range(4, 10)),
    # The start is included, the end is excluded, exactly, also at 0.1 s.
    (Selection(start=0.1, duration=0.2), [1, 2]),
    (Selection(duration=0.1), [0]),
    (Selection(duration=0.11), [0, 1]),
    (Selection(every=3), [0, 3, 6, 9]),
    (Selection(start=0.2, every=3), [2, 5, 8]),
    (Selection(start=0.2, duration=0.5, every=2), [2, 4, 6]),
    (Selection(every=100), [0]),
    (Selection(start=0.95), []),
])
def test_selection(selection, expected):
    assert selected(selection, TEN) == list(expected)


@pytest.mark.parametrize('fields', [
    {'start': -0.1}, {'start': float('nan')}, {'start': float('inf')},
    {'start': 1e300}, {'duration': 1e300},
    {'duration': 0}, {'duration': -1.0}, {'duration': float('nan')}, {'duration': float('inf')},
    {'every': 0}, {'every': -1}, {'every': 1.5}, {'every': True},
])
def test_invalid(fields):
    (name,) = fields
    with pytest.raises(ParameterError, match=name):
        Selection(**fields)


def test_no_start_excludes_nothing():
    """A looped bag jumps back, possibly to before its first stamp."""
    assert selected(Selection(), [5, 6, 2, 3]) == [0, 1, 2, 3]
    assert selected(Selection(every=2), [5, 6, 2, 3]) == [0, 2]


def test_wrong_stamp_does_not_end_the_selection():
    stamps = [*TEN[:3], TEN[3] + 10 ** 15, *TEN[4:]]
    assert selected(Selection(duration=0.6), stamps) == [0, 1, 2, 4, 5]


def test_reading_ends_soon_after_the_selection():
    selector = Selector(Selection(duration=1.0))
    judged = []
    while not selector.over:
        judged.append(selector.judge(len(judged) * TENTH))
    assert judged == [*[True] * 10, *[False] * (Selector.PATIENCE + 1)]
    # A looped bag comes back.
    assert not selector.judge(0)


@given(
    st.lists(st.integers(0, 40), min_size=1, max_size=60), st.integers(0, 30),
    st.one_of(st.none(), st.integers(1, 30)), st.integers(1, 5))
def test_as_defined(steps, start, duration, every):
    stamps = [sum(steps[:count]) * TENTH for count in range(1, len(steps) + 1)]
    first = stamps[0]
    begin = first + start * TENTH
    end = float('inf') if duration is None else begin + duration * TENTH
    inside = [index for index, stamp in enumerate(stamps) if begin <= stamp < end]
    selection = Selection(
        start=start / 10, duration=None if duration is None else duration / 10, every=every)
    assert selected(selection, stamps) == inside[::every]
