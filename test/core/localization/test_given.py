# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The values that the locator is given."""

import cmath
import math

from phase_traj_ros.core import OdometryStep, PositionFix, Prior, ScaleRange
import pytest


def test_a_step_between_poses():
    step = OdometryStep.between((1, 1, 0.0), (1, 3, math.pi), stamp_ns=5)
    assert step.distance == pytest.approx(2.0)
    assert step.yaw == pytest.approx(math.pi)
    assert step.stamp_ns == 5


def test_a_step_backwards_is_negative():
    assert OdometryStep.between((0, 0, 0), (-2, 0, 0), stamp_ns=0).distance == -2.0


@pytest.mark.parametrize('yaw', [0.0, 1e-9, -0.7, math.pi])
def test_the_parts_of_a_step_follow_its_arc(yaw):
    whole = OdometryStep(
        stamp_ns=7, distance=12.0, yaw=yaw, distance_variance=0.3, yaw_variance=0.2,
        scale_variance=0.1)
    parts = whole.parts(4)
    at, heading = 0j, 0.0
    for part in parts:
        at += cmath.rect(part.distance, heading + part.yaw / 2)
        heading += part.yaw
    assert at == pytest.approx(cmath.rect(12.0, yaw / 2))
    assert heading == pytest.approx(yaw)
    for name in ('distance_variance', 'yaw_variance', 'scale_variance'):
        assert sum(getattr(part, name) for part in parts) == pytest.approx(getattr(whole, name))
    assert {part.stamp_ns for part in parts} == {7}
    assert len(set(parts)) == 1 and whole.parts(1) == [whole]


def test_noise_across_the_heading_is_not_driven():
    assert OdometryStep.between((0, 0, 0), (0.1, 0.3, 0), stamp_ns=0).distance == 0.1
    assert OdometryStep.between((0, 0, 0), (0.0, 0.3, 0), stamp_ns=0).distance == 0.0


def test_yaw_takes_the_short_way_round():
    assert OdometryStep.between((0, 0, 3.1), (0, 0, -3.1), stamp_ns=0).yaw == pytest.approx(
        math.tau - 6.2)


def test_the_scale_is_between_its_bounds():
    scale = ScaleRange(0.5, 2.0)
    assert scale.middle == pytest.approx(1.0)
    assert scale.log_deviation == pytest.approx(math.log(2.0) / 1.96)
    assert ScaleRange(2.0, 2.0).log_deviation == 1e-6


@pytest.mark.parametrize('wrong', [
    lambda: OdometryStep(stamp_ns=0, distance=math.nan, yaw=0.0),
    lambda: OdometryStep(stamp_ns=0, distance=1.0, yaw=0.0, yaw_variance=-1.0),
    lambda: OdometryStep(stamp_ns=0, distance=1.0, yaw=0.0, scale_variance=-1.0),
    lambda: ScaleRange(2.0, 1.0),
    lambda: ScaleRange(0.0, 1.0),
    lambda: Prior(math.inf, 0.0, 5.0),
    lambda: Prior(0.0, 0.0, 0.0),
    lambda: PositionFix(0.0, math.nan, 1.0, 1.0),
    lambda: PositionFix(0.0, 0.0, 0.0, 1.0),
    lambda: PositionFix(0.0, 0.0, 1.0, 1.7e308),
    lambda: PositionFix(0.0, 0.0, 1.0, 1.0, 1.0)])
def test_what_is_no_value_is_refused(wrong):
    with pytest.raises(ValueError, match='give'):
        wrong()
