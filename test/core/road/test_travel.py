# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
import math

from phase_traj_ros.core import TravelState
from phase_traj_ros.core.road.travel import Travel
import pytest


def test_the_names_of_the_states_are_an_interface():
    assert [state.value for state in TravelState] == [
        'measured', 'bridged', 'standing', 'given', 'unknown']


@pytest.mark.parametrize(('state', 'known', 'measured'), [
    ('measured', True, True), ('standing', True, True), ('given', True, True),
    ('bridged', True, False), ('unknown', False, False)])
def test_a_bridged_distance_is_known_and_not_measured(state, known, measured):
    travel = Travel(1.0, 0.1, TravelState(state))
    assert (travel.known, travel.measured) == (known, measured)


def test_the_variance_of_a_distance_is_that_of_its_independent_errors():
    """Errors of 1 cm, and of 3, 4 and 12 % of 5 m: they are independent of each other."""
    shares = 0.03, 0.04, 0.12
    variance = 0.01 ** 2 + sum((share * 5.0) ** 2 for share in shares)
    travel = Travel(5.0, variance, TravelState.MEASURED, *shares)
    assert travel.own_variance == pytest.approx(0.01 ** 2)
    # Rounded down to less than nothing, it is nothing.
    assert Travel(5.0, 0.01, TravelState.MEASURED, *shares).own_variance == 0.0


def test_a_distance_in_metres_has_the_error_of_the_height_as_well():
    travel = Travel(5.0, 0.2 ** 2, TravelState.MEASURED, scale=0.03)
    metres = travel.scaled(1.6, 0.04)
    assert metres.distance == pytest.approx(8.0)
    assert metres.variance == pytest.approx((1.6 * 0.2) ** 2 + (0.04 * 8.0) ** 2)
    assert metres.scale == pytest.approx(0.05)
    assert metres.own_variance == pytest.approx(travel.own_variance * 1.6 ** 2)


def test_parts_of_a_distance_make_up_the_whole():
    """Independent errors add up in squares, those that both parts share as they are."""
    shares = 0.03, 0.04, 0.12
    whole = Travel(
        5.0, 0.1 ** 2 + sum((share * 5.0) ** 2 for share in shares), TravelState.MEASURED, *shares)
    first, rest = whole.part(2.0, 0.4), whole.part(3.0, 0.6)
    assert first.own_variance + rest.own_variance == pytest.approx(whole.own_variance)
    assert (first.own_variance, rest.own_variance) == pytest.approx((0.004, 0.006))
    shared = [math.sqrt(part.variance - part.own_variance) for part in (first, rest, whole)]
    assert shared[0] + shared[1] == pytest.approx(shared[2]) == pytest.approx(5.0 * 0.13)
    assert (first.distance, first.swing, first.tilt, first.scale) == (2.0, *shares)
