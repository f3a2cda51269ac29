# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The chain code as text."""

from hypothesis import given, strategies as st
from phase_traj_ros.core import DynamicChainCode
from phase_traj_ros.core.codes.from_heading import HeadingCode
from phase_traj_ros.core.codes.links import LinkCode
from phase_traj_ros.core.codes.text import describe, describe_links, parse_chain_code, parse_links
import pytest

SHIFTS = st.lists(st.floats(-40, 40), max_size=60)


def coded(shifts, **options):
    codes = DynamicChainCode(**options)
    for dx in shifts:
        codes.update(dx)
    return codes


def test_the_text_is_pinned():
    codes = coded([0] * 3 + [-20] * 4 + [0] * 2)
    assert str(describe(codes, frames=10)) == (
        'frames 10; movement 9 (0:0 1:5 2:1 3:3) 1x3 2x1 3x3 1x2;'
        ' direction 6 (0:0 1:3 2:3 3:0) 1x3 2x3')
    assert str(describe(codes, frames=10, max_runs=1)) == (
        'frames 10; movement 9 (0:0 1:5 2:1 3:3) ... 1x2;'
        ' direction 6 (0:0 1:3 2:3 3:0) ... 2x3')
    assert str(describe(coded([]), frames=0)) == (
        'frames 0; movement 0 (0:0 1:0 2:0 3:0); direction 0 (0:0 1:0 2:0 3:0)')


def test_eight_directions():
    codes = HeadingCode(connectivity=8)
    for heading in (0.0, 0.0, -1.0, -1.0):
        codes.update(heading, 0.0)
    text = describe(codes, frames=5)
    assert str(text) == (
        'frames 5; movement 4 (0:0 1:3 2:1 3:0) 1x2 2x1 1x1;'
        ' direction 4 (0:0 1:2 2:2 3:0 4:0 5:0 6:0 7:0) 2x2 1x2')
    assert parse_chain_code(str(text)) == text


@given(SHIFTS, st.none() | st.integers(1, 5), st.none() | st.integers(1, 5))
def test_what_is_written_can_be_read(shifts, kept, shown):
    text = describe(coded(shifts, max_runs=kept), frames=len(shifts) + 1, max_runs=shown)
    assert parse_chain_code(str(text)) == text
    assert text.movement.length == len(shifts)
    assert '\n' not in str(text)


@pytest.mark.parametrize('text', [
    '', 'frames 1', 'frames -1; movement 0 (0:0 1:0 2:0 3:0); direction 0 (0:0 1:0 2:0 3:0)',
    'frames 2; movement 1 (0:0 1:1 2:0 3:0) 1x1; direction 1 (0:0 1:1 2:0 3:0) 1x2',
    'frames 2; movement 1 (0:0 1:1 2:0 3:0) 1x1; direction 1 (0:0 1:1 2:0 3:0) 4x1',
    'frames 2; movement 1 (0:0 1:1 2:0 3:0) 1x1; direction 1 (0:1 1:1 2:0 3:0) 1x1',
    'frames 2; movement 1 (0:0 1:1 2:0 3:0) ... 1x1; direction 1 (0:0 1:1 2:0 3:0) 1x1',
    'frames 2; movement 1 (0:0 1:1 2:0 3:0) 1x1; direction 1 (0:0 1:1 2:0 3:0) 1x1\n',
])
def test_what_does_not_follow_the_grammar_is_refused(text):
    with pytest.raises(ValueError, match=r'chain code text|series'):
        parse_chain_code(text)


@pytest.mark.parametrize(('connectivity', 'unit', 'expected'), [
    (4, 'm', 'step 2.5 m; links 5 (0:2 1:3 2:0 3:0) 1x3 0x2'),
    (8, 'camera heights',
     'step 2.5 camera heights; links 5 (0:0 1:0 2:3 3:1 4:1 5:0 6:0 7:0) 2x3 3x1 4x1')])
def test_links_have_a_line_of_their_own(connectivity, unit, expected):
    links = LinkCode(2.5, connectivity=connectivity)
    links.add(7.5, 0.0, 0.0)
    links.add(5.0, 1.6, 0.0)
    text = describe_links(links, unit=unit)
    assert str(text) == expected
    assert parse_links(expected) == text
    shown = describe_links(links, unit=unit, max_runs=1)
    assert ' ... ' in str(shown) and parse_links(str(shown)) == shown


@pytest.mark.parametrize('text', [
    '', 'links 0 (0:0 1:0 2:0 3:0)', 'step x m; links 0 (0:0 1:0 2:0 3:0)',
    'step 1 m; links 2 (0:0 1:1 2:0 3:0) 1x1'])
def test_what_is_not_about_links_is_refused(text):
    with pytest.raises(ValueError, match=r'equal links|series'):
        parse_links(text)
