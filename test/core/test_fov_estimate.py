# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The field of view from the drive itself."""

import math

import numpy as np
from phase_traj_ros.core.fov_estimate import FieldOfViewEstimator, scale_between
from phase_traj_ros.core.projection import focal_from_hfov
import pytest

WIDTH = 1241


def measured(angles, *, true_hfov, assumed_hfov):
    """Return what an estimator knows that is given true angles, measured with a wrong focal."""
    focal, assumed = (focal_from_hfov(each, WIDTH) for each in (true_hfov, assumed_hfov))
    estimator = FieldOfViewEstimator(WIDTH, assumed_focal_px=assumed)
    for angle in angles:
        estimator.add(angle * focal / assumed)
    return estimator.estimate


@pytest.mark.parametrize('true_hfov', [50.0, 62.0, 81.6, 110.0])
@pytest.mark.parametrize('assumed_hfov', [60.0, 75.0, 100.0])
def test_right_angles_tell_the_field_of_view(true_hfov, assumed_hfov):
    angles = 90 + np.random.default_rng(0).normal(0, 5, 12)
    found = measured(angles, true_hfov=true_hfov, assumed_hfov=assumed_hfov)
    assert found.hfov_deg == pytest.approx(true_hfov, rel=0.05)
    assert found.sureness > 0.9
    assert found.turns == 12


def test_bends_by_other_angles_do_no_harm():
    angles = [88, -93, 40, 91, -55, 35, -86, 95, 120, 89, -47]
    found = measured(angles, true_hfov=81.6, assumed_hfov=75.0)
    assert found.hfov_deg == pytest.approx(81.6, rel=0.05)


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


def test_scale_undoes_the_wrong_focal_length():
    focal, assumed = focal_from_hfov(81.6, WIDTH), focal_from_hfov(60.0, WIDTH)
    measured_angle = 90 * focal / assumed
    assert measured_angle * scale_between(81.6, assumed, WIDTH) == pytest.approx(90)


def test_refuses_nonsense():
    estimator = FieldOfViewEstimator(WIDTH, assumed_focal_px=700.0)
    with pytest.raises(ValueError, match='finite'):
        estimator.add(math.nan)
