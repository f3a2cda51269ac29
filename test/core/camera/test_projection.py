# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The cylinder: yaw is one shift over the whole width, whatever the camera."""

from dataclasses import replace
import math

import cv2
from far_scene import barrel, BARREL_COEFFICIENTS, bearings, fisheye, FISHEYE_COEFFICIENTS, render
from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.camera.model import CameraModel, Distortion
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.camera.tuning import TUNING
from phase_traj_ros.errors import FrameError
import pytest

SHAPE = (240, 400)
FOCAL = 230.0
CAMERA = CameraModel.pinhole(SHAPE, FOCAL)

# Distorted cameras, and the radius in the picture (in focal lengths) by the angle from the axis.
BARREL = CameraModel(
    width=640, height=480, fx=330.0, fy=330.0, cx=322.0, cy=236.0, distortion=Distortion.BROWN,
    coefficients=BARREL_COEFFICIENTS)
FISHEYE = CameraModel(
    width=640, height=480, fx=210.0, fy=210.0, cx=316.0, cy=243.0, distortion=Distortion.FISHEYE,
    coefficients=FISHEYE_COEFFICIENTS)


LENSES = {'barrel': (BARREL, barrel), 'fisheye': (FISHEYE, fisheye)}


def without_distortion(camera):
    return replace(camera, distortion=Distortion.NONE, coefficients=())


def pinhole(azimuth, shape=SHAPE, focal=FOCAL):
    """Return what a camera sees of a far pattern when turned to the right by ``azimuth``."""
    height, width = shape
    x = (np.arange(width) - (width - 1) / 2) / focal
    y = (np.arange(height) - (height - 1) / 2) / focal
    theta = np.arctan(x)[None] + azimuth
    slope = y[:, None] * np.cos(np.arctan(x))[None]
    picture = 128 + 50 * np.sin(31 * theta) + 50 * np.cos(17 * theta + 23 * slope)
    return picture.astype(np.float32)


def test_yaw_is_the_same_shift_everywhere():
    projection = CylinderProjection(CAMERA)
    pixels = 12
    before = projection(pinhole(0.0))
    after = projection(pinhole(-pixels / projection.px_per_rad))
    inside = projection.inside[:, 8:-24]
    difference = np.abs(after[:, pixels + 8:-24 + pixels] - before[:, 8:-24])[inside]
    # Content has moved to the right: the camera has turned left.
    assert difference.max() < 3.0


def test_without_the_cylinder_it_is_not():
    before, after = pinhole(0.0), pinhole(-12 / FOCAL)
    assert np.abs(after[:, 20:-12] - before[:, 8:-24]).max() > 50.0


def test_azimuths_and_slopes_are_where_the_camera_sees_them():
    projection = CylinderProjection(replace(CAMERA, cx=210.0, cy=100.0))
    position = np.indices(SHAPE).astype(np.float32)
    rows, columns = (projection(each) for each in position)
    azimuth, slope = projection.azimuths[None], projection.slopes[:, None]
    inside = projection.inside
    assert columns[inside] == pytest.approx(
        np.broadcast_to(210 + FOCAL * np.tan(azimuth), projection.shape)[inside], abs=0.05)
    # Beyond the last row, what is projected is the edge.
    inner = inside & (rows > 1) & (rows < SHAPE[0] - 2)
    assert rows[inner] == pytest.approx((100 + FOCAL * slope / np.cos(azimuth))[inner], abs=0.05)


@pytest.mark.parametrize(('shape', 'focal'), [
    ((376, 1241), 718.856), ((240, 320), 266.0), ((480, 640), 457.0), ((1080, 1920), 1500.0),
    ((720, 1280), 2389.0), ((400, 640), 224.0), ((240, 320), 160.0)])
def test_size_is_bounded_whatever_the_camera(shape, focal):
    projection = CylinderProjection(CameraModel.pinhole(shape, focal))
    assert projection.px_per_rad <= focal
    assert 150 < projection.shape[1] < 600 and 60 < projection.shape[0] < 300
    frame = np.zeros(shape, np.uint8)
    assert projection(frame).shape == projection.shape
    assert projection(frame).dtype == np.uint8


@pytest.mark.parametrize('dtype', [np.uint8, np.uint16, np.float32])
def test_keeps_the_type_and_averages_large_frames(dtype):
    # A pattern too fine for the cylinder has to become grey, not another pattern.
    frame = np.indices((720, 1280)).sum(axis=0) % 2 * 200
    projected = CylinderProjection(CameraModel.pinhole((720, 1280), 1100.0))(frame.astype(dtype))
    assert projected.dtype == dtype
    assert np.ptp(projected.astype(float)) < 25


def test_band_is_given_in_angles():
    projection = CylinderProjection(
        CameraModel.pinhole((2000, 3000), 1000.0),
        tuning=replace(TUNING, above_deg=10.0, below_deg=5.0, side_deg=20.0))
    assert projection.slopes[0] == pytest.approx(-math.tan(math.radians(10)), abs=0.01)
    assert projection.slopes[-1] == pytest.approx(math.tan(math.radians(5)), abs=0.01)
    assert projection.azimuths[[0, -1]] == pytest.approx(np.radians((-20, 20)), abs=0.01)
    assert projection.inside.all()


def test_a_line_of_sight_keeps_its_column_at_all_heights():
    # A vertical edge in the world is vertical on the cylinder, too.
    frame = np.zeros(SHAPE, np.uint8)
    cv2.line(frame, (330, 0), (330, 239), 255, 2)
    columns = CylinderProjection(CAMERA)(frame).argmax(axis=1)
    assert np.ptp(columns) <= 1


def strip_yaws(projection, before, after, expected, strips=6):
    """Return the yaw, in degrees, under which each of some strips side by side agrees best."""
    before, after = (projection(each).astype(np.float32) for each in (before, after))
    whole = np.flatnonzero(projection.inside.all(axis=1))
    rows = slice(whole[0], whole[-1])
    yaws = np.linspace(0.5, 1.5, 201) * expected
    errors = []
    for pixels in np.radians(yaws) * projection.px_per_rad:
        back = cv2.warpAffine(after, np.array(((1, 0, -pixels), (0, 1, 0))), after.shape[::-1])
        # What has come in is nowhere in the frame before.
        square = ((back - before)[rows, :-int(pixels) - 2]**2).mean(axis=0)
        errors.append([strip.mean() for strip in np.array_split(square, strips)])
    return yaws[np.argmin(errors, axis=0)]


@pytest.mark.parametrize('name', LENSES)
def test_azimuths_and_slopes_are_where_a_distorted_camera_sees_them(name):
    camera, radius = LENSES[name]
    projection = CylinderProjection(camera)
    azimuth, slope = (each.astype(np.float32) for each in bearings(camera, radius))
    inside = cv2.erode(projection.inside.astype(np.uint8), np.ones((5, 5))).astype(bool)
    inside[[0, 1, -2, -1]] = inside[:, [0, 1, -2, -1]] = False
    seen = np.broadcast_to(projection.azimuths, projection.shape)
    assert projection(azimuth)[inside] == pytest.approx(seen[inside], abs=2e-4)
    seen = np.broadcast_to(projection.slopes[:, None], projection.shape)
    assert projection(slope)[inside] == pytest.approx(seen[inside], abs=2e-4)


@pytest.mark.parametrize('name', LENSES)
def test_yaw_is_the_same_over_the_whole_width_of_a_distorted_picture(name):
    camera, radius = LENSES[name]
    turn = 1.5
    before, after = (
        render(camera, radius, math.radians(heading)) for heading in (20.0, 20.0 + turn))
    projection = CylinderProjection(camera)
    right = strip_yaws(projection, before, after, turn)
    assert right == pytest.approx(turn, abs=0.03)
    ignored = CylinderProjection(without_distortion(camera))
    wrong = strip_yaws(ignored, before, after, turn)
    assert np.abs(wrong - turn).max() > 10 * np.abs(right - turn).max()
    assert np.ptp(wrong) > 0.2


@pytest.mark.parametrize('name', LENSES)
def test_reaches_as_far_as_the_distorted_picture(name):
    camera, _ = LENSES[name]
    projection = CylinderProjection(camera)
    pinhole = CylinderProjection(without_distortion(camera))
    left, right = projection.azimuths[0], projection.azimuths[-1]
    assert left < pinhole.azimuths[0] - 0.05 and right > pinhole.azimuths[-1] + 0.05
    row = np.abs(projection.slopes).argmin()
    assert projection.inside[row].all()
    assert projection.inside.mean() > 0.95
    # One pixel farther, either the picture ends or the band.
    for azimuth in (left - 1.6 / projection.px_per_rad, right + 1.6 / projection.px_per_rad):
        sight = camera.project(*(np.array([each]) for each in (math.tan(azimuth), 0.0, 1.0)))
        assert not sight.seen[0] or abs(azimuth) > math.radians(60.0)


def test_what_the_model_does_not_hold_for_is_not_shown():
    # From 44 degrees on, this model comes back in: see test_camera.
    camera = replace(BARREL, coefficients=(-0.35, 0.0, 0.0, 0.0))
    projection = CylinderProjection(camera)
    assert 0.74 < np.abs(projection.azimuths).max() < math.radians(44.5)
    radius = np.hypot(np.tan(projection.azimuths), np.outer(
        projection.slopes, 1 / np.cos(projection.azimuths)))
    assert not projection.inside[radius > 0.98].any()
    assert projection.inside[radius < 0.96].all()
    # There, the edge of what holds is repeated: nothing from farther inside.
    columns = projection(np.indices(camera.shape)[1].astype(np.float32))
    assert (np.diff(columns, axis=1)[:, 1:-1] > -0.05).all()


def test_part_of_a_sensor_without_its_optical_axis():
    camera = replace(BARREL, height=120, cy=-40.0)
    projection = CylinderProjection(camera)
    plain = CylinderProjection(without_distortion(camera))
    assert 0.0 < projection.slopes[0] == pytest.approx(plain.slopes[0], abs=0.02)
    assert projection.inside.mean() > 0.8
    with pytest.raises(FrameError, match='show too little'):
        CylinderProjection(replace(BARREL, cy=-4000.0))


def test_pixels_need_not_be_square():
    frame = render(BARREL, barrel, 0.0)
    tall = cv2.resize(frame, (640, 960), interpolation=cv2.INTER_CUBIC)
    # The middle of a pixel is not where it was.
    camera = replace(BARREL, height=960, fy=2 * BARREL.fy, cy=2 * BARREL.cy + 0.5)
    one, other = CylinderProjection(BARREL), CylinderProjection(camera)
    assert other.shape == one.shape
    # Twice as many rows are averaged, and so lose a little of what is fine.
    assert np.abs(one(frame).astype(float) - other(tall)).mean() < 1.5


def test_each_direction_is_averaged_as_much_as_it_needs():
    # Rows too fine for the cylinder, columns that are not.
    camera = CameraModel(width=400, height=1600, fx=270.0, fy=1080.0, cx=199.5, cy=799.5)
    projection = CylinderProjection(camera)
    stripes = np.zeros(camera.shape, np.uint8)
    stripes[::2] = 200
    assert np.ptp(projection(stripes)) <= 1
    stripes = np.zeros(camera.shape, np.uint8)
    stripes[:, 100:300] = 200
    assert (projection(stripes)[40] == 200).sum() == pytest.approx(
        2 * math.atan(100 / 270) * projection.px_per_rad, abs=3)


def test_refuses_what_cannot_be():
    with pytest.raises(FrameError, match='10x12 pixels show too little'):
        CylinderProjection(CameraModel.pinhole((12, 10), 8.0))
    with pytest.raises(FrameError, match='show too little'):
        CylinderProjection(replace(CAMERA, cx=1e6))
    with pytest.raises(FrameError, match='show too little'):
        CylinderProjection(replace(CAMERA, fx=1e-300, fy=1e6))
    with pytest.raises(FrameError, match='show too little'):
        CylinderProjection(replace(CAMERA, fy=1e-300, cy=-1e9))
    # A misplaced decimal point would make a cylinder of 96000 rows.
    with pytest.raises(FrameError, match='too large'):
        CylinderProjection(CameraModel(
            width=320, height=96, fx=3e6, fy=3e3, cx=160.0, cy=48.0))
    with pytest.raises(FrameError, match='too large'):
        CylinderProjection(CameraModel(
            width=320, height=96, fx=1e9, fy=3.0, cx=160.0, cy=48.0))
    with pytest.raises(FrameError, match='too large'):
        CylinderProjection(CameraModel.pinhole((200, 40_000), 100.0))


@given(st.floats(1.0, 170.0), st.integers(1, 4000))
def test_focal_length_and_field_of_view_are_inverse(hfov, width):
    focal_px = Lens(hfov_deg=hfov).focal_for(width)
    assert focal_px == pytest.approx(width / 2 / math.tan(math.radians(hfov) / 2))
    assert Lens(focal_px=focal_px).hfov_for(width) == pytest.approx(hfov)
    # What the user has given is told as it was given.
    assert Lens(hfov_deg=hfov).hfov_for(width) == hfov


def test_focal_length_of_kitti():
    assert Lens(hfov_deg=81.6).focal_for(1241) == pytest.approx(718.9, rel=2e-3)


@pytest.mark.parametrize('hfov', [0.0, 5e-324, 180.0, math.nan])
def test_refuses_impossible_fields_of_view(hfov):
    with pytest.raises(ValueError, match='hfov_deg'):
        Lens(hfov_deg=hfov)
