# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is told of the camera that a drive is measured with."""

import math

from phase_traj_ros.core.camera.in_use import CameraInUse
from phase_traj_ros.core.camera.lens import Lens, LensOrigin
from phase_traj_ros.core.camera.model import CameraModel, Distortion
import pytest


def test_a_calibrated_fisheye_is_told_by_its_calibration():
    calibration = CameraModel(
        width=480, height=360, fx=200.0, fy=200.0, cx=263.5, cy=180.0,
        distortion=Distortion.FISHEYE, coefficients=(0.0, 0.0, 0.0, 0.0))
    camera = CameraInUse.of(Lens(camera=calibration), 480)
    assert camera.origin is LensOrigin.CALIBRATION
    assert camera.focal_px == 200.0
    # An equidistant one: as far as a pinhole's 100 degrees, and farther.
    assert camera.hfov_deg == pytest.approx(math.degrees(480 / 200), abs=0.3)
    assert camera.offset == pytest.approx(0.05)
    assert camera.straightness is None
