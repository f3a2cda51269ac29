# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A camera that points aside, up or down is found out on straights, and turns nothing."""

from dataclasses import replace
import math

import numpy as np
from phase_traj_ros.core import (
    CameraModel,
    CodeSource,
    EstimatorSettings,
    Lens,
    TrajectoryEstimator,
)
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion, Mounting
from phase_traj_ros.core.rotation.tuning import TUNING
from phase_traj_ros.core.rotation.yaw_meter import YawMeter
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
import pytest

SURE = math.radians(0.3) ** 2


def travelled(rng, *, mounted=0.0, slope=0.0, rate_hz, seconds=30.0, turn=0.0):
    """Return the mounting after a drive whose direction of travel sways for a second each time."""
    mounting, sway, kept = Mounting(), 0.0, math.exp(-1.0 / rate_hz)
    for _ in range(round(seconds * rate_hz)):
        sway = kept * sway + rng.normal(0.0, math.radians(1.0) * math.sqrt(1.0 - kept * kept))
        mounting.add(FocusOfExpansion(
            mounted + sway + 0.4 * turn, slope + sway, SURE, SURE), 1.0 / rate_hz, turn)
    return mounting


@pytest.mark.parametrize('rate_hz', [5, 60])
def test_it_scatters_as_it_says_at_any_frame_rate(rate_hz):
    rng = np.random.default_rng(rate_hz)
    drawn = rng.normal(0.0, TUNING.mounting_deviation, 100)
    found = [travelled(rng, mounted=angle, rate_hz=rate_hz) for angle in drawn]
    off = [(one.angle - angle) / one.deviation for one, angle in zip(found, drawn)]
    assert 0.4 < np.mean(np.square(off)) < 2.5
    assert np.mean([one.deviation for one in found]) < math.radians(0.5)


def test_pairs_far_apart_are_independent_of_each_other():
    rng = np.random.default_rng(3)
    drawn = rng.normal(0.0, TUNING.mounting_deviation, 400)
    found = [travelled(rng, mounted=angle, rate_hz=0.25) for angle in drawn]
    off = [(one.angle - angle) / one.deviation for one, angle in zip(found, drawn)]
    assert np.mean(np.square(off)) == pytest.approx(1.0, abs=0.3)


def test_a_turn_tells_nothing():
    mounting = travelled(np.random.default_rng(1), mounted=0.0, rate_hz=10, turn=0.5)
    assert mounting.angle == 0.0 and mounting.deviation >= TUNING.mounting_deviation


def test_it_may_be_pushed():
    mounting = travelled(np.random.default_rng(2), mounted=0.0, rate_hz=10, seconds=600.0)
    sure = mounting.deviation
    travelled(np.random.default_rng(2), mounted=0.0, rate_hz=10)
    for _ in range(6000):
        mounting.add(FocusOfExpansion(0.0, 0.0, SURE, SURE), 0.1, 1.0)
    assert mounting.deviation > 2.0 * sure


@pytest.mark.parametrize('rate_hz', [5, 60])
@pytest.mark.parametrize('pitch_deg', [-10.0, 0.0, 15.0])
def test_a_tilted_camera_measures_a_share_of_a_turn(pitch_deg, rate_hz):
    pitch = math.radians(pitch_deg)
    mounting = travelled(
        np.random.default_rng(4), slope=-math.tan(pitch), rate_hz=rate_hz, seconds=10.0)
    # A quarter of a degree in a corner of 90 degrees.
    assert mounting.level == pytest.approx(math.cos(pitch), abs=0.003)
    in_a_turn = travelled(np.random.default_rng(4), slope=1.0, rate_hz=rate_hz, turn=0.5)
    assert in_a_turn.level == 1.0


def test_the_pitch_outlasts_a_reset_and_the_azimuth_does_not():
    meter = YawMeter(CylinderProjection(CameraModel(
        width=480, height=180, fx=300.0, fy=300.0, cx=240.0, cy=90.0)))
    known = travelled(np.random.default_rng(5), mounted=0.05, slope=-0.2, rate_hz=10)
    meter.mounting = known
    meter.reset()
    assert (meter.mounting.level, meter.mounting.angle) == (known.level, 0.0)
    assert meter.mounting.deviation == TUNING.mounting_deviation
    meter.mounting.add(FocusOfExpansion(0.0, 0.0, SURE, SURE), 0.1, 0.0)
    # It is as sure as before.
    assert meter.mounting.level == pytest.approx(known.level, abs=0.001)


def test_a_camera_that_points_aside_does_not_turn_a_straight_road():
    drive = plan_drive(
        '', [Straight(6), Turn(-30, 3), Straight(6)], rate_hz=10.0, speed=9.0, seed=5,
        camera=Camera.with_field_of_view(480, 180, 85))
    camera, poses = drive.camera, drive.poses.copy()
    poses[:, 2] += math.radians(4.0)
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.HEADING, lens=Lens(camera=CameraModel(
            width=480, height=180, fx=camera.focal, fy=camera.focal, cx=camera.cx,
            cy=camera.cy))))
    for index, frame in enumerate(render_drive(replace(drive, poses=poses))):
        update = estimator.update(frame, drive.stamps_ns[index])
    true = poses[-1, 2] - poses[0, 2]
    # About 3 without it.
    assert abs(math.degrees(update.heading.heading - true)) < 1.25
