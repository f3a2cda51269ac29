# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera's tilt, and where the horizon is."""

import math

import numpy as np
from phase_traj_ros.core.camera.horizon import Horizon, HorizonEstimator
from phase_traj_ros.synthetic.camera import BODY_TO_PICTURE, rotation
import pytest

(PITCH, ROLL) = (math.radians(10.0), math.radians(-3.0))


def test_down_is_that_of_a_pose():
    tilted = rotation(0.7, PITCH, ROLL)
    expected = BODY_TO_PICTURE @ tilted.T @ (0.0, 0.0, -1.0)
    np.testing.assert_allclose(Horizon(PITCH, ROLL).down(), expected, atol=1e-12)


def test_levelling_makes_down_point_down_and_keeps_ahead_ahead():
    horizon = Horizon(PITCH, ROLL)
    level = horizon.levelling()
    np.testing.assert_allclose(level @ level.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(level @ horizon.down(), (0, 1, 0), atol=1e-12)
    (right, _, ahead) = level @ (0, 0, 1)
    assert right == pytest.approx(0.0, abs=1e-12)
    assert ahead > 0.9


def test_a_level_camera_may_point_aside():
    horizon, azimuth = Horizon(PITCH, ROLL), math.radians(20.0)
    level, aside = horizon.levelling(), horizon.levelling(azimuth)
    np.testing.assert_allclose(aside @ horizon.down(), (0, 1, 0), atol=1e-12)
    right_of_ahead = level.T @ (math.sin(azimuth), 0.0, math.cos(azimuth))
    np.testing.assert_allclose(aside @ right_of_ahead, (0, 0, 1), atol=1e-12)


@pytest.mark.parametrize('azimuth_deg', [0.0, 15.0, -25.0])
def test_the_pitch_makes_the_direction_of_travel_level(azimuth_deg):
    azimuth = math.radians(azimuth_deg)
    # Travel along the road, in image axes; then its azimuth and slope on the cylinder.
    x, y, z = Horizon(PITCH, ROLL).levelling(azimuth).T @ (0, 0, 1)
    course, slope = math.atan2(x, z), y / math.hypot(x, z)
    assert Horizon(roll=ROLL).pitch_along(course, slope) == pytest.approx(PITCH, abs=1e-9)


@pytest.mark.parametrize('azimuth_deg', [0.0, 15.0])
@pytest.mark.parametrize('slip_deg', [10.0, -10.0])
def test_a_vehicle_that_leans_slips_along_the_road(azimuth_deg, slip_deg):
    azimuth, slip, lean = (math.radians(angle) for angle in (azimuth_deg, slip_deg, 18.0))
    # The road in the axes of the vehicle, whose right side is down.
    sine, cosine = math.sin(lean), math.cos(lean)
    along = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]]) @ (
        math.sin(slip), 0.0, math.cos(slip))
    x, y, z = Horizon(PITCH, ROLL).levelling(azimuth).T @ along
    pitch = Horizon(roll=ROLL).pitch_along(
        math.atan2(x, z), y / math.hypot(x, z), azimuth=azimuth, lean=lean)
    # Without the lean, it is 3 degrees off.
    assert math.degrees(pitch - PITCH) == pytest.approx(0.0, abs=0.5)


def test_the_axes_of_turns_tell_pitch_and_roll():
    estimator = HorizonEstimator()
    for _ in range(5):
        estimator.add_turn(Horizon(PITCH, ROLL).down(), math.radians(1.0))
    found = estimator.horizon
    assert math.degrees(found.pitch - PITCH) == pytest.approx(0.0, abs=0.1)
    assert math.degrees(found.roll - ROLL) == pytest.approx(0.0, abs=0.4)
    assert found.pitch_deviation < Horizon().pitch_deviation / 5


def test_one_axis_that_is_far_off_hardly_counts():
    estimator = HorizonEstimator()
    for pitch in (PITCH, PITCH, PITCH, math.radians(-40.0), PITCH):
        estimator.add_turn(Horizon(pitch, ROLL).down())
    assert math.degrees(estimator.horizon.pitch) == pytest.approx(10.0, abs=1.0)


def test_recordings_are_combined_by_how_sure_they_are():
    estimator = HorizonEstimator()
    estimator.add(Horizon(PITCH, 0.0, 0.002, 0.01))
    estimator.add(Horizon(0.5 * PITCH, 0.0, 0.05, 0.05))
    assert math.degrees(estimator.horizon.pitch) == pytest.approx(10.0, abs=0.1)
