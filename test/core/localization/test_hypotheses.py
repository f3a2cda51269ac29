# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The number of hypotheses stays in bounds, and their weights stay what they mean."""

import numpy as np
from phase_traj_ros.core import LocatorSettings
from phase_traj_ros.core.localization.filter.hypotheses import Hypotheses
from phase_traj_ros.core.localization.filter.resampling import merged, pruned, resampled, split
import pytest

SETTINGS = LocatorSettings()


def some(log_weight, piece=None, offset=0.5):
    count = len(log_weight)
    return Hypotheses(
        np.arange(count) if piece is None else np.asarray(piece), np.full(count, offset),
        *np.zeros((4, count)), np.ones(count), np.zeros((5, count), complex),
        np.asarray(log_weight, float))


def test_hypotheses_of_little_weight_are_dropped():
    assert pruned(some([0.0, -13.0, -15.0]), SETTINGS).piece.tolist() == [0, 1]


def test_those_that_are_alike_become_one_of_their_weight():
    rng = np.random.default_rng(0)
    result = merged(some(np.log([0.2, 0.3, 0.5]), piece=[4, 4, 7]), SETTINGS, rng)
    assert dict(zip(result.piece.tolist(), np.exp(result.log_weight))) == pytest.approx(
        {4: 0.5, 7: 0.5})


def test_those_in_other_places_scales_or_headings_stay():
    rng = np.random.default_rng(0)
    for name, width in (('offset', 2.0), ('log_scale', 0.02), ('rotation', 0.5)):
        them = some([0.0, 0.0], piece=[3, 3])
        setattr(them, name, np.array([0.1, 0.1 + width]))
        assert len(merged(them, SETTINGS, rng)) == 2, name


def test_the_one_that_stays_is_drawn_by_weight():
    rng = np.random.default_rng(0)
    kept = []
    for _ in range(400):
        them = some(np.log([0.25, 0.75]), piece=[3, 3])
        them.offset = np.array([0.1, 0.2])
        kept += merged(them, SETTINGS, rng).offset.tolist()
    assert np.mean(np.isclose(kept, 0.2)) == pytest.approx(0.75, abs=0.08)


def test_resampling_keeps_the_heavy_and_the_expected_weights():
    rng = np.random.default_rng(1)
    weight = np.concatenate([[0.3, 0.2], np.full(50, 0.01)])
    sums = np.zeros(len(weight))
    for _ in range(300):
        drawn = resampled(some(np.log(weight)), 12, rng)
        assert len(drawn) <= 13
        assert {0, 1} <= set(drawn.piece.tolist())
        np.add.at(sums, drawn.piece, np.exp(drawn.log_weight))
    np.testing.assert_allclose(sums[:2] / 300, weight[:2])
    assert sums[2:].sum() / 300 == pytest.approx(0.5, rel=0.01)


def test_few_hypotheses_are_not_resampled():
    them = some([0.0, -1.0])
    assert resampled(them, 2, np.random.default_rng(0)) is them


def test_the_heavy_are_split_into_parts_of_one_weight():
    weight = np.array([0.6, 0.3, 0.05, 0.03, 0.02])
    parts = split(some(np.log(weight)), 34)
    np.testing.assert_allclose(np.bincount(parts.piece, np.exp(parts.log_weight)), weight)
    count = np.bincount(parts.piece)
    assert len(parts) == pytest.approx(34, abs=3)
    assert np.ptp((weight / count)[:3]) < 0.5 * weight[2]
    assert (np.diff(count) <= 0).all() and count.min() == 1


@pytest.mark.parametrize('count', [4, 5])
def test_enough_hypotheses_are_not_split(count):
    them = some(np.zeros(count))
    assert split(them, 4) is them
