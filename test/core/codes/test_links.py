# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The chain code of equal links."""

from itertools import pairwise
import math

from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core import Direction, vertices
from phase_traj_ros.core.codes.freeman import Freeman
from phase_traj_ros.core.codes.from_heading import HeadingCode
from phase_traj_ros.core.codes.links import LinkCode
import pytest

RIGHT_ANGLE = math.pi / 2
# (length, angle) of each part of the way. The last bend takes 30 s at 5 m/s: 3 degrees a second.
STREET = (
    (63.0, 0.0), (12.0, RIGHT_ANGLE), (48.0, 0.0), (19.0, -RIGHT_ANGLE), (77.0, 0.0),
    (18.0, 2 * RIGHT_ANGLE), (90.0, 0.0), (150.0, -RIGHT_ANGLE), (80.0, 0.0))
ORDER = [1, 0, 1, 0, 3, 0]


def heading_at(way):
    places = np.cumsum([0.0, *(length for length, _ in STREET)])
    return np.interp(way, places, np.cumsum([0.0, *(angle for _, angle in STREET)]))


def drive(speed, rate):
    """Return the way at each frame; ``speed`` is a function of the way."""
    ways, length = [0.0], sum(length for length, _ in STREET)
    while ways[-1] < length:
        ways.append(ways[-1] + speed(len(ways) / rate, ways[-1]) / rate)
    return np.minimum(ways, length)


def links(ways, step=2.0, **options):
    code = LinkCode(step, **options)
    headings = heading_at(ways)
    for distance, heading, yaw in zip(np.diff(ways), headings[1:], np.diff(headings)):
        code.add(float(distance), float(heading), float(yaw))
    return code


def with_a_stop(seconds, way):
    """Stop for five seconds in the middle of the first corner."""
    return 0.0 if way >= 69.0 and seconds < 12.0 else 10.0


def wavering(seconds, way):
    return 8.0 + 6.0 * math.sin(seconds)


DRIVES = {
    'fast': drive(lambda *_: 10.0, 10), 'half the speed': drive(lambda *_: 5.0, 10),
    'twice the rate': drive(lambda *_: 10.0, 20), 'with a stop': drive(with_a_stop, 10),
    'wavering': drive(wavering, 30), 'motorway': drive(lambda *_: 33.0, 10)}


def test_links_are_counted_along_the_way():
    code = links(DRIVES['fast'])
    length = sum(length for length, _ in STREET)
    assert len(code.series) == math.floor(length / 2.0) == 278
    assert [int(run.code) for run in code.series.runs] == ORDER


@pytest.mark.parametrize('name', DRIVES)
@pytest.mark.parametrize('step', [0.5, 2.0, 7.0])
def test_they_depend_on_neither_speed_nor_stops_nor_rate(name, step):
    expected, found = links(DRIVES['fast'], step).series.runs, links(DRIVES[name], step).series
    assert [run.code for run in found.runs] == [run.code for run in expected]
    for run, other in zip(found.runs, expected):
        assert abs(run.count - other.count) <= 1


def test_the_code_per_pair_does_depend_on_them():
    lengths = set()
    for ways in DRIVES.values():
        code, headings = HeadingCode(), heading_at(ways)
        for before, after in pairwise(headings):
            code.update(after, after - before)
        lengths.add(len(code.direction))
    assert max(lengths) > 10 * min(lengths)


def test_what_is_drawn_has_the_lengths_of_the_street():
    # A corner is where the heading is 6 degrees past the border of two sectors: 51, 141.
    drawn = vertices(links(DRIVES['fast'], 1.0).series)
    corners = [0, *np.flatnonzero(np.any(np.diff(drawn, 2, axis=0) != 0, axis=1)) + 1]
    sides = np.linalg.norm(np.diff(drawn[corners], axis=0), axis=1)
    assert sides == pytest.approx([69.8, 64.0, 90.3, 9.0, 178.9], abs=1.5)


@given(
    st.lists(st.floats(0.0, 9.0), max_size=40), st.floats(-2.0, 2.0), st.sampled_from([4, 8]),
    st.floats(0.1, 5.0))
def test_there_is_one_for_each_step_of_the_way(distances, yaw, connectivity, step):
    code, heading, ended = LinkCode(step, connectivity=connectivity), 0.0, []
    for distance in distances:
        heading += yaw
        ended += code.add(distance, heading, yaw)
    assert len(ended) == len(code.series) == pytest.approx(sum(distances) / step, abs=1.001)
    assert ended == list(code.series)
    for before, after in pairwise(ended):
        assert (after - before) % connectivity in (0, 1, connectivity - 1)


def test_standing_adds_nothing():
    code = LinkCode(1.0)
    code.add(0.9, 0.0, 0.0)
    for _ in range(100):
        assert code.add(0.0, 2.0, 0.02) == ()
    # The heading counts when the vehicle moves on; consecutive directions are neighbours.
    assert code.add(0.1, 2.0, 0.0) == (Direction.LEFT,)


def test_what_is_reversed_is_made_up_for():
    code = LinkCode(1.0)
    assert len(code.add(5.5, 0.0, 0.0)) == 5
    assert code.add(-3.0, 0.0, 0.0) == code.add(3.4, 0.0, 0.0) == ()
    assert len(code.add(0.2, 0.0, 0.0)) == 1


def test_within_a_pair_the_heading_is_that_of_the_place():
    assert LinkCode(1.0).add(4.0, RIGHT_ANGLE, RIGHT_ANGLE) == (1, 1, 0, 0)
    assert LinkCode(1.0, connectivity=8).add(4.0, -RIGHT_ANGLE, -RIGHT_ANGLE) == (
        Freeman.FORWARD, Freeman.FORWARD_RIGHT, Freeman.FORWARD_RIGHT, Freeman.RIGHT)


def test_a_jump_of_the_stamps_is_no_way():
    assert LinkCode(1.0).add(1e10, 0.0, 0.0) == ()


@pytest.mark.parametrize('values', [
    (math.nan, 0.0, 0.0), (1.0, math.inf, 0.0), (1.0, 0.0, math.nan)])
def test_what_is_not_finite_is_refused(values):
    code = LinkCode(1.0)
    with pytest.raises(ValueError, match='give finite numbers'):
        code.add(*values)
    assert len(code.add(1.0, 0.0, 0.0)) == 1


@pytest.mark.parametrize('step', [0.0, 0.05, -1.0, math.inf, math.nan])
def test_a_step_that_cannot_be_is_refused(step):
    with pytest.raises(ValueError, match='or more'):
        LinkCode(step)
