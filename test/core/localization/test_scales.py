# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Scales are drawn from the prior, and after a turn from what the way since the last one tells."""

import math

import numpy as np
from phase_traj_ros.core import LocatorSettings, ScaleRange
from phase_traj_ros.core.localization.hypotheses import Hypotheses
from phase_traj_ros.core.localization.seeding import Scales, spread_of
from phase_traj_ros.core.localization.window import Stride
import pytest

RANGE = ScaleRange(1.1, 2.2)
MIDDLE = math.log(RANGE.middle)


def stride(bend):
    return Stride(5.0, 0.0, 0.0, 0.0, (0j,) * 5, 0.0, bend, 0.0)


def some(count):
    """Return hypotheses with scales of the prior, of which nothing is known yet."""
    them = Hypotheses(
        np.arange(count), *np.zeros((3, count)), np.full(count, -1.0), np.zeros(count),
        np.ones(count), np.zeros((count, 5), complex), np.zeros(count))
    return scales().drawn(them, 1)


def scales():
    return Scales(RANGE, LocatorSettings(), np.random.default_rng(0))


def turn(maker, them, most=3000):
    return maker.after(maker.after(them, stride(1.5), 5.0, most), stride(0.0), 5.0, most)


def test_the_first_scales_are_those_of_the_prior():
    log_scale = some(2000).log_scale
    assert log_scale.mean() == pytest.approx(MIDDLE, abs=0.01)
    assert log_scale.std() == pytest.approx(spread_of(RANGE), rel=0.03)


def test_copies_cover_the_scales_and_share_the_weight():
    drawn = scales().drawn(some(50), 10)
    assert np.exp(drawn.log_weight).sum() == pytest.approx(50.0)
    for piece in range(50):
        ranks = np.sort(drawn.log_scale[drawn.piece == piece])
        # One copy in each tenth of the prior.
        assert len(ranks) == 10 and ranks[0] < MIDDLE - spread_of(RANGE) < MIDDLE < ranks[-1]


def test_without_a_turn_nothing_is_drawn():
    maker, them = scales(), some(20)
    assert maker.after(them, stride(0.1), 5.0, 3000) is them


def test_the_first_turn_tells_nothing_of_the_scale():
    drawn = turn(scales(), some(20))
    assert len(drawn) == pytest.approx(3000, rel=0.1)
    for piece in range(20):
        those = drawn.log_scale[drawn.piece == piece]
        assert those.std() == pytest.approx(spread_of(RANGE), rel=0.15)


def test_the_way_between_turns_tells_the_scale_the_longer_the_better():
    spreads = []
    for metres in (50.0, 200.0):
        maker = scales()
        them = turn(maker, some(20), most=20)
        them.log_scale[:] = MIDDLE + 0.2
        maker.after(them, stride(0.0), metres, 3000)
        drawn = turn(maker, them)
        assert drawn.log_scale.mean() == pytest.approx(MIDDLE + 0.2, abs=0.04)
        spreads.append(drawn.log_scale.std())
    assert spreads[1] < spreads[0] < spread_of(RANGE) / 1.5
