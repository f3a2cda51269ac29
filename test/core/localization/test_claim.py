# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A place is claimed while it is probable; turns that fit are evidence, straights are not."""

import math

import numpy as np
from phase_traj_ros.core import LocatorSettings, OdometryStep
from phase_traj_ros.core.localization.hypotheses import Hypotheses
from phase_traj_ros.core.localization.likelihood import judge
from phase_traj_ros.core.localization.places import Claim, Place
from phase_traj_ros.core.localization.window import Odometer
import pytest

SETTINGS = LocatorSettings()


def place(at=0.0, probability=0.999):
    return Place(complex(at), 0.0, probability, 8.0, np.eye(3), 0.0, 0.01)


@pytest.fixture
def claim():
    """Return a claim of a place that has been probable for long enough."""
    claim = Claim(SETTINGS)
    for _ in range(30):
        claim.follow(place(), 5.0)
    return claim


def test_a_place_is_claimed_when_it_has_been_probable_for_long_enough(claim):
    new = Claim(SETTINGS)
    new.follow(place(), 5.0)
    assert claim.held and not new.held


def test_a_claimed_place_may_become_less_probable_for_a_while(claim):
    claim.follow(place(probability=0.6), 5.0)
    assert claim.held


@pytest.mark.parametrize('other', [place(at=200.0), place(probability=0.3)])
def test_a_place_that_jumps_or_is_improbable_is_dropped(claim, other):
    claim.follow(other, 5.0)
    assert not claim.held


def evidence(driven, road, *, start=0.0):
    """Return the evidence after a way for a road; both are headings in radians each 5 m."""
    odometer = Odometer(5.0, 4)
    trail = np.array([odometer.trail])
    them = Hypotheses(
        np.zeros(1, int), np.zeros(1), np.zeros(1), np.zeros(1),
        np.full(1, math.radians(2.0) ** 2), trail, np.zeros(1), np.full(1, start))
    before = 0.0
    for number, (heading, street) in enumerate(zip(driven, road)):
        stride = odometer.add(OdometryStep(stamp_ns=number, distance=5.0, yaw=heading - before))
        before = heading
        ends = np.concatenate([them.trail[0], [them.trail[0, -1] + 5.0 * np.exp(1j * street)]])
        them.trail = ends[None, 1:]
        judge(them, stride, SETTINGS, SETTINGS.bend_error)
    return float(them.evidence[0])


STRAIGHT = np.zeros(40)
CORNERS = np.repeat([0.0, 0.5, 0.0, -0.5, -1.0], 8) * math.pi


def test_turns_that_fit_are_evidence():
    assert evidence(CORNERS, CORNERS) > 5.0


@pytest.mark.parametrize('length', [40, 400])
def test_a_straight_road_is_no_evidence_however_long(length):
    assert -1.0 < evidence(np.zeros(length), np.zeros(length)) <= 0.0


@pytest.mark.parametrize('late', [3, 5])
def test_turns_elsewhere_are_evidence_against(late):
    assert evidence(CORNERS, np.roll(CORNERS, late)) < evidence(CORNERS, CORNERS) - 5.0
    assert evidence(STRAIGHT, CORNERS) < -5.0


def test_the_vehicle_may_leave_the_roads_after_any_evidence():
    assert evidence(np.tile(CORNERS, 5), np.tile(CORNERS, 5)) == SETTINGS.most_evidence
