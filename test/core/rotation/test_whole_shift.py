# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The shift of the image as a whole, at the size of the cylinder and at half of it."""

from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.correlation.phase_correlation import Shift
from phase_traj_ros.core.rotation.tuning import TUNING
from phase_traj_ros.core.rotation.whole_shift import WholeShift
import pytest
from textures import pair


@pytest.mark.parametrize('focal_px', [270.0, 360.0])
def test_shifts_are_in_pixels_of_the_cylinder_at_either_size(focal_px):
    projection = CylinderProjection(CameraModel.pinhole((240, 320), focal_px))
    whole = WholeShift(projection, None)
    first, second = pair(projection.shape, 14.0, -6.0)
    assert whole.update(first) is None
    found = whole.update(second)
    assert (found.dx, found.dy) == (pytest.approx(14.0, abs=0.3), pytest.approx(-6.0, abs=0.3))
    # The peak stands out at its place only, and the second one is beside it.
    assert whole.significance(found) > 2 * TUNING.min_significance
    beside = whole.second_peak()
    assert max(abs(beside.dx - found.dx), abs(beside.dy - found.dy)) > TUNING.peak_distance_px
    assert whole.significance(beside) < whole.significance(found) / 2


def test_frames_of_a_few_rows_are_not_halved():
    projection = CylinderProjection(CameraModel.pinhole((9, 620), 380.0))
    whole = WholeShift(projection, None)
    first, second = pair(projection.shape, 4.0, 0.0)
    assert whole.update(first) is None
    assert whole.update(second).dx == pytest.approx(4.0, abs=0.3)


@pytest.mark.parametrize(('shift', 'moves', 'significance', 'expected'), [
    ((0.3, -0.4), False, 20.0, (0.3, -0.4)),
    # A pattern that is fixed to the camera does not move with the scene.
    ((0.3, -0.4), True, 20.0, (9.0, 1.0)),
    ((5.0, -0.4), True, 20.0, (5.0, -0.4)),
    ((5.0, -0.4), True, 1.0, None),
    ((0.3, -0.4), True, 1.0, None),
    # No camera shakes as far.
    ((5.0, 2.0 * TUNING.max_shake_px), False, 20.0, None)])
def test_the_shift_of_the_scene_is_significant_and_not_that_of_a_fixed_pattern(
        shift, moves, significance, expected, monkeypatch):
    whole = WholeShift(CylinderProjection(CameraModel.pinhole((240, 320), 360.0)), None)
    monkeypatch.setattr(WholeShift, 'significance', lambda *_: significance)
    monkeypatch.setattr(WholeShift, 'second_peak', lambda _: Shift(9.0, 1.0, 0.1))
    found = whole.of_scene(Shift(*shift, 0.2), moves=moves)
    assert (None if found is None else (found.dx, found.dy)) == expected


def test_a_new_start_has_no_pair():
    projection = CylinderProjection(CameraModel.pinhole((240, 320), 360.0))
    whole = WholeShift(projection, None)
    first, second = pair(projection.shape, 14.0, -6.0)
    whole.update(first)
    whole.correlator.reset()
    assert whole.update(second) is None
