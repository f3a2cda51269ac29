# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a turn leaves open of the scale: all at the first one, then less the longer the way."""

import math

import numpy as np
from phase_traj_ros.core import LocatorSettings, ScaleRange
from phase_traj_ros.core.localization.filter.hypotheses import Hypotheses
from phase_traj_ros.core.localization.filter.scales import ScaleCorrection
from phase_traj_ros.core.localization.filter.strides import Stride
import pytest

RANGE = ScaleRange(1.1, 2.2)
MIDDLE, PRIOR = math.log(RANGE.middle), RANGE.log_deviation ** 2


def stride(turned):
    return Stride(
        distance=5.0, in_reverse=0.0, displacement=5.0 + 0j, distance_variance=0.0,
        yaw_variance=0.0, scale_variance=0.0, chord=0.0, bend=abs(turned), turned=turned,
        repeated=False)


def some(count=20):
    """Return hypotheses with the scale of the prior, of which nothing is known yet."""
    return Hypotheses(
        np.arange(count), np.zeros(count), np.full(count, MIDDLE), np.full(count, PRIOR),
        np.full(count, np.inf), np.zeros(count), np.zeros(count), np.zeros((5, count), complex),
        np.zeros(count))


def filtered(them, log_scale, variance):
    """Let the filter find this scale."""
    count = len(them)
    them.log_scale, them.scale_variance = np.full(count, log_scale), np.full(count, variance)


def turn(correction, them, turned=1.5):
    """Drive through a turn; return how many copies cover each hypothesis after it."""
    assert correction.follow(them, stride(turned), 5.0) == 1
    return correction.follow(them, stride(0.0), 5.0)


def test_without_a_turn_nothing_changes():
    correction, them = ScaleCorrection(RANGE, LocatorSettings()), some()
    filtered(them, MIDDLE + 0.1, PRIOR / 9)
    assert turn(correction, them, turned=0.3) == 1
    assert (them.log_scale == MIDDLE + 0.1).all() and (them.scale_variance == PRIOR / 9).all()


@pytest.mark.parametrize('turned', [1.5, -1.5])
def test_the_first_turn_tells_nothing_of_the_scale(turned):
    correction, them = ScaleCorrection(RANGE, LocatorSettings()), some()
    filtered(them, MIDDLE + 0.1, PRIOR / 100)
    assert turn(correction, them, turned) > 10
    assert them.log_scale == pytest.approx(MIDDLE)
    assert them.scale_variance == pytest.approx(PRIOR)


def test_the_way_between_turns_tells_the_scale_the_longer_the_better():
    left, copies = [], []
    for metres in (50.0, 500.0):
        correction, them = ScaleCorrection(RANGE, LocatorSettings()), some()
        turn(correction, them)
        correction.follow(them, stride(0.0), metres)
        filtered(them, MIDDLE + 0.2, PRIOR / 100)
        copies.append(turn(correction, them))
        assert them.log_scale == pytest.approx(MIDDLE + 0.2)
        left.append(float(them.scale_variance.mean()))
    assert PRIOR / 100 < left[1] < left[0] < PRIOR
    assert copies[1] < copies[0]


def test_a_scale_that_is_known_needs_no_copies():
    exact = ScaleRange(1.65, 1.65)
    correction, them = ScaleCorrection(exact, LocatorSettings()), some()
    assert turn(correction, them) == 1
    assert them.log_scale == pytest.approx(math.log(1.65))


def test_after_an_interruption_the_first_turn_tells_nothing_either():
    correction, them = ScaleCorrection(RANGE, LocatorSettings()), some()
    correction.interrupt(4.0)
    filtered(them, MIDDLE + 0.1, PRIOR / 100)
    turn(correction, them)
    assert them.log_scale == pytest.approx(MIDDLE)
    assert them.scale_variance == pytest.approx(PRIOR)


def test_an_unobserved_way_between_two_turns_tells_less_of_the_scale():
    variances = []
    for unobserved in (0.0, 10.0 ** 2, math.inf):
        correction, them = ScaleCorrection(RANGE, LocatorSettings()), some()
        turn(correction, them)
        correction.interrupt(unobserved)
        correction.follow(them, stride(0.0), 300.0)
        filtered(them, MIDDLE + 0.1, PRIOR / 100)
        turn(correction, them)
        variances.append(float(them.scale_variance[0]))
    assert variances[0] < variances[1] / 2
    assert variances[2] == pytest.approx(PRIOR)
