# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A place that leads is claimed when the way since then alone has proven it."""

import math

import numpy as np
from phase_traj_ros.core import LocatorSettings
from phase_traj_ros.core.localization.places import Claim, Place
import pytest

SETTINGS = LocatorSettings()
ENOUGH = SETTINGS.claim_evidence + 0.1


def place(at=0.0, probability=0.999):
    return Place(complex(at), 0.0, probability, np.eye(3), 0.0, 0.01)


@pytest.fixture
def leading():
    """Return a claim of a place that was found with much evidence, and has just begun to lead."""
    claim = Claim(SETTINGS)
    while not claim.leads:
        claim.follow(place(), 5.0, evidence=50.0, turned=20.0)
    return claim


def test_the_evidence_that_chose_a_place_does_not_prove_it(leading):
    assert not leading.held


def test_the_way_since_proves_it(leading):
    leading.follow(place(), 5.0, evidence=50.0 + ENOUGH, turned=20.0 + math.pi)
    assert leading.held


@pytest.mark.parametrize(('evidence', 'turned'), [(0.0, 10.0), (ENOUGH, 1.0), (-5.0, 10.0)])
def test_neither_turns_nor_a_straight_road_alone_prove_it(leading, evidence, turned):
    leading.follow(place(), 5.0, evidence=50.0 + evidence, turned=20.0 + turned)
    assert leading.leads and not leading.held


@pytest.mark.parametrize('other', [place(at=200.0), place(probability=0.3)])
def test_another_place_has_to_be_proven_anew(leading, other):
    leading.follow(place(), 5.0, evidence=50.0 + ENOUGH, turned=20.0 + math.pi)
    leading.follow(other, 5.0, evidence=50.0 + ENOUGH, turned=20.0 + math.pi)
    assert not leading.held
    for _ in range(10):
        leading.follow(
            place(at=200.0), 5.0, evidence=50.0 + 1.5 * ENOUGH, turned=20.0 + 1.5 * math.pi)
    assert leading.leads and not leading.held


def test_a_jump_of_the_evidence_by_a_fix_or_a_gap_is_no_proof(leading):
    leading.doubt()
    leading.follow(place(), 5.0, evidence=90.0, turned=40.0)
    assert not leading.held


def test_something_else_proves_only_a_place_that_leads(leading):
    none = Claim(SETTINGS)
    none.prove()
    leading.prove()
    assert leading.held and not none.held
