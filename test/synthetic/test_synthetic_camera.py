# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera's geometry: axes, tilt, field of view."""

from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.synthetic import Camera, KITTI_CAMERA, Pose
from phase_traj_ros.synthetic.camera import (
    BODY_TO_PICTURE,
    EQUIDISTANT,
    EQUISOLID,
    fisheye_radius,
    level_view,
    quaternion,
    rotation,
    STEREOGRAPHIC,
)
import pytest

TILT = st.floats(-0.15, 0.15)


def test_positive_angles_turn_left_nose_down_and_right_side_down():
    (ahead, left) = (np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    assert (rotation(0.1, 0, 0) @ ahead)[1] > 0
    assert (rotation(0, 0.1, 0) @ ahead)[2] < 0
    assert (rotation(0, 0, 0.1) @ left)[2] > 0


@given(st.floats(-3, 3), TILT, TILT)
def test_the_quaternion_is_the_rotation(yaw, pitch, roll):
    (x, y, z, w) = quaternion(Pose(0, 0, yaw, pitch, roll))
    assert x * x + y * y + z * z + w * w == pytest.approx(1)
    axis = np.array([x, y, z])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = (w * w - axis @ axis) * np.eye(3) + 2 * np.outer(axis, axis) + 2 * w * cross
    np.testing.assert_allclose(matrix, rotation(yaw, pitch, roll), atol=1e-12)


@given(TILT, TILT, st.floats(0, 1240), st.floats(0, 375))
def test_a_pixel_of_a_tilted_picture_is_found_in_the_level_one(pitch, roll, column, row):
    (level, homography) = level_view(KITTI_CAMERA, pitch, roll)
    (x, y, scale) = homography @ (column, row, 1)
    (x, y) = (x / scale, y / scale)
    assert 0 <= x <= level.width - 1
    assert 0 <= y <= level.height - 1
    seen = np.linalg.inv(KITTI_CAMERA.matrix()) @ (column, row, 1)
    turned = BODY_TO_PICTURE @ rotation(0, pitch, roll) @ BODY_TO_PICTURE.T @ seen
    expected = level.matrix() @ turned
    assert (x, y) == pytest.approx(tuple(expected[:2] / expected[2]), abs=1e-6)


def test_a_camera_on_its_side_is_refused():
    with pytest.raises(ParameterError, match='nearly level'):
        level_view(KITTI_CAMERA, 1.2, 0.0)


def test_the_field_of_view_is_from_edge_to_edge():
    camera = Camera.with_field_of_view(320, 240, 90.0)
    assert camera.focal == pytest.approx(160)
    assert (camera.cx, camera.cy) == (159.5, 119.5)


@pytest.mark.parametrize('wrong', [
    {'width': 0}, {'focal': 0.0}, {'focal': float('nan')}, {'above_ground': -1.0}])
def test_invalid_cameras_are_refused(wrong):
    with pytest.raises(ParameterError):
        Camera(**wrong)


@pytest.mark.parametrize('hfov', [0, 180, float('nan')])
def test_a_field_of_view_that_no_plane_holds_is_refused(hfov):
    with pytest.raises(ParameterError, match='field of view'):
        Camera.with_field_of_view(320, 240, hfov)


@pytest.mark.parametrize(('fisheye', 'known'), [
    (STEREOGRAPHIC, lambda a: 2 * np.tan(a / 2)), (EQUIDISTANT, lambda a: a),
    (EQUISOLID, lambda a: 2 * np.sin(a / 2))])
def test_the_fisheyes_are_what_they_are_called(fisheye, known):
    angle = np.linspace(0, np.radians(70), 20)
    np.testing.assert_allclose(fisheye_radius(angle, fisheye), known(angle), rtol=1e-4)


def test_the_field_of_view_of_a_fisheye_is_from_edge_to_edge():
    camera = Camera.with_field_of_view(320, 240, 120.0, fisheye=EQUIDISTANT)
    assert camera.focal == pytest.approx(160 / np.radians(60))
