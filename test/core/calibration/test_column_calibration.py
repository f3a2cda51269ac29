# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the turns tell of a lens that is given."""

import math

import numpy as np
from phase_traj_ros.core.calibration.column_calibration import ColumnCalibration
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
import pytest

CAMERA = Camera.with_field_of_view(320, 160, 75.0)
GIVEN = Lens(focal_px=CAMERA.focal)


@pytest.fixture(scope='module')
def turned():
    """Return what is known after a turn of 75 degrees, seen with the right lens."""
    drive = plan_drive('a turn', [Straight(0.5), Turn(75, 3), Straight(0.5)], rate_hz=10.0,
                       speed=5.0, camera=CAMERA, seed=4)
    calibration = ColumnCalibration(GIVEN)
    shifts = [0.0, *(CAMERA.focal * np.diff(drive.poses[:, 2]))]
    for frame, shift in zip(render_drive(drive), shifts):
        calibration.update(frame, shift, 0.1 if shift else 0.0)
    calibration.finish()
    return calibration


def test_before_the_first_frame_it_is_the_given_lens():
    calibration = ColumnCalibration(GIVEN)
    calibration.finish()
    assert calibration.lens == GIVEN
    assert not calibration.settled and not calibration.contradicted


def test_a_turn_tells_the_column_and_no_other_focal_length(turned):
    assert turned.turns >= 1
    assert (turned.lens.focal_px, turned.estimate) == (CAMERA.focal, None)
    assert 0.0 < abs(turned.lens.offset) < 0.01
    assert not turned.contradicted


def test_frames_of_another_size_are_of_another_camera(turned):
    turned.update(np.zeros((90, 160), np.uint8), 0.0, 0.0)
    assert turned.turns == 0
    assert turned.lens.offset == 0.0 and not turned.settled
    assert math.isclose(turned.lens.focal_for(160), CAMERA.focal)
