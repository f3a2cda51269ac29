# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A place is claimed after it has been probable for a while, on a way with turns."""

import numpy as np
from phase_traj_ros.core import LocatorSettings
from phase_traj_ros.core.localization.claim import Claim
from phase_traj_ros.core.localization.places import Place
import pytest

SETTINGS = LocatorSettings()


def place(at=0.0, probability=0.999):
    return Place(complex(at), 0.0, probability, np.eye(3), 0.0, 0.01)


@pytest.fixture
def leading():
    """Return a claim of a place that has just begun to lead, without any turn."""
    claim = Claim(SETTINGS)
    while not claim.leads:
        claim.follow(place(), 5.0, turned=0.0)
    return claim


def test_nothing_is_claimed_without_turns(leading):
    assert not leading.held
    leading.follow(place(), 5.0, turned=SETTINGS.claim_turned + 0.1)
    assert leading.held


@pytest.mark.parametrize('other', [place(at=200.0), place(probability=0.3)])
def test_another_place_has_to_lead_for_a_while(leading, other):
    leading.follow(place(), 5.0, turned=20.0)
    leading.follow(other, 5.0, turned=20.0)
    assert not leading.held
    ways = 0.0
    while not leading.held:
        leading.follow(place(at=200.0), 5.0, turned=20.0)
        ways += 5.0
    assert ways >= SETTINGS.claim_after_m


def test_a_fix_proves_only_a_place_that_leads(leading):
    none = Claim(SETTINGS)
    none.prove()
    leading.prove()
    assert leading.held and not none.held


def test_where_the_vehicle_is_on_the_map_no_turns_are_needed():
    claim = Claim(SETTINGS, on_map=True)
    while not claim.leads:
        claim.follow(place(), 5.0, turned=0.0)
    assert claim.held
