# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Codes from the heading."""

from itertools import accumulate
import math

from hypothesis import given, strategies as st
from phase_traj_ros.core import Direction, Movement
from phase_traj_ros.core.codes.freeman import Freeman, freeman, to_four
from phase_traj_ros.core.codes.from_heading import HeadingCode
import pytest

L, F, R, N = Movement
YAWS = st.lists(st.floats(-4.0, 4.0), max_size=80)


def drive(yaws_deg, interval=0.1, **options):
    """Return the code of a drive, given by the yaw of each pair in degrees."""
    codes = HeadingCode(**options)
    heading = 0.0
    for yaw in yaws_deg:
        heading += math.radians(yaw)
        codes.update(heading, math.radians(yaw) / interval)
    return codes


def turn(angle, pairs=30):
    return [angle / pairs] * pairs


def changes(codes):
    return [int(code) for code in codes.movement if code in (L, R)]


STRAIGHT = [0.0] * 20


@pytest.mark.parametrize(('plan', 'expected'), [
    (STRAIGHT, []),
    ([*STRAIGHT, *turn(90), *STRAIGHT], [0]),
    ([*STRAIGHT, *turn(-90), *STRAIGHT], [2]),
    ([*STRAIGHT, *turn(180, 50), *STRAIGHT], [0, 0]),
    ([*STRAIGHT, *turn(-360, 90), *STRAIGHT], [2, 2, 2, 2]),
    ([*STRAIGHT, *turn(45), *turn(-45), *STRAIGHT], []),
    ([*STRAIGHT, *turn(-40), *turn(80), *turn(-40), *STRAIGHT], []),
    # A gentle bend: 3 degrees per second.
    ([*STRAIGHT, *turn(90, 300), *STRAIGHT], [0]),
    ([*turn(90), *STRAIGHT, *turn(-90), *turn(-90)], [0, 2, 2]),
])
def test_the_direction_changes_when_the_heading_has(plan, expected):
    codes = drive(plan)
    assert changes(codes) == expected
    net = sum(1 - code for code in expected)
    assert codes.heading == (Direction.FORWARD - net) % 4


def test_movement_is_no_change_only_while_it_yaws():
    codes = list(drive([*STRAIGHT, *turn(90), *STRAIGHT]).movement)
    assert set(codes[:20]) == {F} and set(codes[50:]) == {F}
    assert sorted(set(codes[20:50])) == [L, N]
    assert codes.count(L) == 1
    # A gentle bend is forward, and turns on the pair that crosses the border.
    assert list(drive(turn(90, 300)).movement).count(N) == 0


def test_hysteresis_keeps_a_heading_near_the_border_from_flickering():
    wobble = [*turn(45), *[3.0, -3.0] * 50]
    assert changes(drive(wobble)) == []
    assert changes(drive([*turn(53), *[3.0, -3.0] * 50])) == [0]


@pytest.mark.parametrize('scale', [0.864, 1.0, 1.155])
def test_three_right_angles_survive_a_wrong_field_of_view(scale):
    # 10 % too narrow or too wide at KITTI's 81.6 degrees.
    plan = [*STRAIGHT, *turn(90), *STRAIGHT, *turn(90), *STRAIGHT, *turn(90), *STRAIGHT]
    assert changes(drive([scale * yaw for yaw in plan])) == [0, 0, 0]


def test_the_first_pair_is_forward_whatever_it_does():
    codes = HeadingCode()
    step = codes.update(math.pi, math.pi / 0.1)
    assert (step.movement, step.direction) == (F, Direction.FORWARD)
    # The next pairs follow, one sector each.
    assert codes.update(math.pi, 0.0).direction is Direction.LEFT
    assert codes.update(math.pi, 0.0).direction is Direction.BACKWARD
    assert codes.update(math.pi, 0.0).movement is F


def test_skip_appends_no_direction():
    codes = drive(turn(90))
    before = list(codes.direction)
    assert codes.skip().movement is N
    assert list(codes.direction) == before
    assert codes.turn is L
    codes.skip(end_turn=True)
    assert codes.turn is None


def test_turn_under_way():
    assert drive([0.0, 2.0]).turn is L
    assert drive([0.0, -2.0]).turn is R
    assert drive([0.0, -2.0, 0.1]).turn is None


@pytest.mark.parametrize('connectivity', [4, 8])
@given(yaws=YAWS, skipped=st.sets(st.integers(0, 79)))
def test_invariants_whatever_the_heading_does(connectivity, yaws, skipped):
    codes = HeadingCode(connectivity=connectivity)
    for index, heading in enumerate(accumulate(yaws)):
        if index in skipped:
            codes.skip(end_turn=index % 2 == 0)
        else:
            codes.update(heading, yaws[index] / 0.1)
    movement, direction = list(codes.movement), list(codes.direction)
    assert len(movement) == len(yaws)
    assert len(direction) == len(movement) - movement.count(N)
    assert all(type(code) is codes.directions for code in direction)
    eight = [Freeman.FORWARD, *(code if connectivity == 8 else freeman(code)
                                for code in direction)]
    moved = [code for code in movement if code is not N]
    step = {L: 8 // connectivity, F: 0, R: -8 // connectivity}
    assert all(
        (after - before) % 8 == step[code] % 8
        for before, after, code in zip(eight, eight[1:], moved))


@given(YAWS)
def test_mirrored_headings_give_mirrored_codes(yaws):
    one, other = drive(yaws), drive([-yaw for yaw in yaws])
    mirror = {L: R, R: L, F: F, N: N}
    assert [mirror[code] for code in one.movement] == list(other.movement)


@given(st.lists(st.floats(-40.0, 40.0), max_size=120))
def test_the_direction_is_never_far_from_the_heading(yaws):
    codes, heading = HeadingCode(), 0.0
    for yaw in yaws:
        heading += math.radians(yaw)
        codes.update(heading, math.radians(yaw) / 0.1)
    off = (math.degrees(heading) - 90 * (Direction.FORWARD - codes.heading)) % 360
    if len(yaws) > 1:
        assert min(off, 360 - off) <= 51.0 + 40.0


def test_eight_directions():
    codes = drive([*STRAIGHT, *turn(45), *STRAIGHT, *turn(45), *STRAIGHT], connectivity=8)
    assert [run.code for run in codes.direction.runs] == [
        Freeman.FORWARD, Freeman.FORWARD_LEFT, Freeman.LEFT]
    assert changes(codes) == [0, 0]
    circle = drive([*turn(-360, 100), *STRAIGHT], connectivity=8)
    assert [int(run.code) for run in circle.direction.runs] == [2, 1, 0, 7, 6, 5, 4, 3, 2]


def test_maps_between_four_and_eight():
    assert [int(freeman(code)) for code in Direction] == [4, 2, 0, 6]
    for code in Direction:
        assert to_four(freeman(code)) is code
    # A diagonal does not change the direction yet.
    assert to_four(Freeman.FORWARD_LEFT) is to_four(Freeman.FORWARD_RIGHT) is Direction.FORWARD
    assert to_four(Freeman.BACKWARD_LEFT) is Direction.LEFT
    assert to_four(Freeman.BACKWARD_RIGHT) is Direction.RIGHT


def test_series_stay_bounded():
    codes = HeadingCode(max_runs=3)
    for index in range(1000):
        codes.update(math.radians(90 * (index // 10 % 2)), 0.0)
    assert len(codes.movement.runs) == len(codes.direction.runs) == 3
    assert len(codes.movement) == 1000


def test_invalid_arguments_are_refused():
    with pytest.raises(ValueError, match='connectivity is 6'):
        HeadingCode(connectivity=6)
    codes = HeadingCode()
    for heading, rate in ((math.nan, 0.0), (0.0, math.inf)):
        with pytest.raises(ValueError, match='finite'):
            codes.update(heading, rate)
    assert len(codes.movement) == 0
