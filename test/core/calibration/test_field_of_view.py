# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The field of view from the drive itself."""

import math

import numpy as np
from phase_traj_ros.core.calibration.field_of_view import FieldOfViewEstimator, SURE
from phase_traj_ros.core.camera.projection import focal_from_hfov
import pytest


def measured(angles, *, true_hfov, assumed_hfov):
    """Return what an estimator knows that is given true angles, measured with a wrong focal."""
    focal, assumed = (focal_from_hfov(each, 1) for each in (true_hfov, assumed_hfov))
    estimator = FieldOfViewEstimator()
    for angle in angles:
        estimator.add(angle * focal / assumed, focal=assumed)
    return estimator.estimate


@pytest.mark.parametrize('true_hfov', [50.0, 62.0, 81.6, 110.0])
@pytest.mark.parametrize('assumed_hfov', [60.0, 75.0, 100.0])
def test_right_angles_tell_the_field_of_view(true_hfov, assumed_hfov):
    angles = 90 + np.random.default_rng(0).normal(0, 5, 12)
    found = measured(angles, true_hfov=true_hfov, assumed_hfov=assumed_hfov)
    assert found.hfov_deg == pytest.approx(true_hfov, rel=0.05)
    assert found.sureness > SURE
    assert found.turns == 12


def test_the_focal_length_may_change_between_turns():
    one, other = (focal_from_hfov(each, 1) for each in (60.0, 100.0))
    true = focal_from_hfov(81.6, 1)
    estimator = FieldOfViewEstimator()
    for focal in (one, other) * 4:
        estimator.add(90.0 * true / focal, focal=focal)
    assert estimator.estimate.hfov_deg == pytest.approx(81.6, rel=0.02)


def test_bends_by_other_angles_do_no_harm():
    angles = [88, -93, 40, 91, -55, 35, -86, 95, 120, 89, -47]
    found = measured(angles, true_hfov=81.6, assumed_hfov=75.0)
    assert found.hfov_deg == pytest.approx(81.6, rel=0.05)


def test_where_there_are_no_right_angles_it_is_hardly_ever_sure():
    rng = np.random.default_rng(0)
    found = [
        measured(rng.uniform(30, 180, 8), true_hfov=81.6, assumed_hfov=75.0) for _ in range(200)]
    wrong = [each for each in found
             if each.sureness >= SURE and abs(each.hfov_deg / 81.6 - 1) > 0.05]
    assert len(wrong) <= 0.1 * len(found)


@pytest.mark.parametrize('odd', [1080.0, 3600.0, 1e7])
def test_a_spiral_says_nothing(odd):
    angles = [90, -87, 93, -90, 88, 91]
    assert measured([*angles, odd], true_hfov=75.0, assumed_hfov=75.0).hfov_deg == pytest.approx(
        75.0, rel=0.02)
    alone = measured([odd], true_hfov=50.0, assumed_hfov=75.0)
    assert alone.sureness < 0.5 and np.isfinite(alone.deviation_deg)


def test_more_turns_make_it_surer():
    few, many = (
        measured([90] * count, true_hfov=81.6, assumed_hfov=75.0) for count in (1, 8))
    assert few.sureness < 0.8 < many.sureness
    assert many.deviation_deg < few.deviation_deg


def test_without_turns_it_is_not_sure_at_all():
    found = measured([], true_hfov=81.6, assumed_hfov=75.0)
    assert found.sureness < 0.3 and found.turns == 0
    # Small bends say nothing.
    assert measured([20.0] * 50, true_hfov=81.6, assumed_hfov=75.0) == found


def test_refuses_nonsense():
    estimator = FieldOfViewEstimator()
    with pytest.raises(ValueError, match='finite angle'):
        estimator.add(math.nan, focal=0.7)
    for focal in (0.0, math.inf):
        with pytest.raises(ValueError, match='focal is'):
            estimator.add(90.0, focal=focal)
