# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Calibrated cameras: where they see a direction, and where their models end."""

from dataclasses import replace
import math

from hypothesis import given, settings, strategies as st
import numpy as np
from phase_traj_ros.core.camera.model import CameraModel, Distortion
import pytest

BROWN, FISHEYE = Distortion.BROWN, Distortion.FISHEYE
PLAIN = CameraModel(width=640, height=480, fx=330.0, fy=340.0, cx=325.0, cy=230.0)
ALL_14 = (.3, .1, .001, -.002, .01, .8, .2, .05, .001, .002, .003, .001, .02, -.03)


def lens(distortion, *coefficients, **options):
    return replace(PLAIN, distortion=distortion, coefficients=coefficients, **options)


def look(camera, x, y, z=1.0):
    return camera.project(*(np.asarray(each, np.float64) for each in (x, y, z)))


def directions(count=2000):
    random = np.random.default_rng(0)
    return random.uniform(-1.5, 1.5, count), random.uniform(-1.0, 1.0, count)


def test_pinhole_of_a_focal_length():
    camera = CameraModel.pinhole((240, 400), 230.0)
    assert camera.shape == (240, 400)
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (230.0, 230.0, 199.5, 119.5)
    assert camera.distortion is Distortion.NONE


def test_without_distortion():
    sight = look(PLAIN, [0.0, 0.5, 1.2, 0.0, 0.5, 0.0], [0.0, -0.25, 0.0, 0.9, -0.25, 0.0],
                 [1.0, 1.0, 1.0, 1.0, 2.0, -1.0])
    assert sight.columns[:5] == pytest.approx([325, 490, 721, 325, 407.5])
    assert sight.rows[:5] == pytest.approx([230, 145, 230, 536, 187.5])
    assert sight.seen.tolist() == [True, True, False, False, True, False]


def test_the_picture_ends_half_a_pixel_outside_its_last_pixels():
    camera = CameraModel.pinhole((100, 200), 100.0)
    x = np.array([-100.1, -99.9, 99.9, 100.1]) / 100
    assert look(camera, x, 0.0).seen.tolist() == [False, True, True, False]
    assert look(camera, 0.0, x / 2).seen.tolist() == [False, True, True, False]


def test_polynomial_model_as_it_is_documented():
    k1, k2, p1, p2, k3 = coefficients = (-0.28, 0.06, 0.003, -0.002, 0.01)
    x, y = directions()
    square = x**2 + y**2
    radial = 1 + k1 * square + k2 * square**2 + k3 * square**3
    sight = look(lens(BROWN, *coefficients), x, y)
    columns = 325 + 330 * (x * radial + 2 * p1 * x * y + p2 * (square + 2 * x**2))
    rows = 230 + 340 * (y * radial + p1 * (square + 2 * y**2) + 2 * p2 * x * y)
    assert sight.seen.mean() > 0.5
    assert sight.columns == pytest.approx(columns, abs=1e-6)
    assert sight.rows == pytest.approx(rows, abs=1e-6)


def test_fisheye_model_as_it_is_documented():
    k1, k2, k3, k4 = coefficients = (0.02, -0.01, 0.003, -0.002)
    x, y = directions()
    r = np.hypot(x, y)
    angle = np.arctan(r)
    bent = angle * (1 + k1 * angle**2 + k2 * angle**4 + k3 * angle**6 + k4 * angle**8)
    sight = look(lens(FISHEYE, *coefficients), x, y)
    assert sight.columns == pytest.approx(325 + 330 * x * bent / r, abs=1e-6)
    assert sight.rows == pytest.approx(230 + 340 * y * bent / r, abs=1e-6)


@pytest.mark.parametrize(('distortion', 'coefficients'), [
    (Distortion.NONE, ()), (BROWN, ALL_14), (BROWN, ALL_14[:12]), (BROWN, ALL_14[:8]),
    (BROWN, (-0.4, 0.1, 0.01, -0.02)), (FISHEYE, (0.1, 0.0, -0.02, 0.01))])
def test_turned_camera_sees_the_turned_picture(distortion, coefficients):
    camera = lens(distortion, *coefficients)
    x, y = directions()
    sight, turned = look(camera, x, y), look(camera.turned_180(), -x, -y)
    assert turned.columns == pytest.approx(639 - sight.columns)
    assert turned.rows == pytest.approx(479 - sight.rows)
    np.testing.assert_array_equal(turned.seen, sight.seen)
    assert camera.turned_180().turned_180() == camera


def test_strong_barrel_does_not_fold_back_into_the_picture():
    # r - 0.35 r^3 grows up to r = 0.976 (44.3 degrees), is back at the middle at r = 1.69, and
    # the picture would be wide enough for 0.95.
    camera = lens(BROWN, -0.35, 0.0, 0.0, 0.0)
    r = np.array([0.0, 0.5, 0.95, 1.0, 1.3, 1.69, 1.8, 3.0, 100.0])
    for turn in np.linspace(0, 2 * math.pi, 50):
        sight = look(camera, r * math.cos(turn), r * math.sin(turn))
        assert sight.seen.tolist() == [True] * 3 + [False] * 6
        # There, the position is that of the last ring that holds, not somewhere inside.
        distance = np.hypot((sight.columns - 325) / 330, (sight.rows - 230) / 340)
        assert distance[3:] == pytest.approx(0.6505, abs=0.001)


def test_pole_of_a_rational_model():
    # 1 / (1 - r^2 / 4): beyond r = 2, all comes in again from the other side.
    camera = lens(BROWN, 0.0, 0.0, 0.0, 0.0, 0.0, -0.25, 0.0, 0.0)
    sight = look(camera, [0.5, 2.5, 4.0, 20.0], 0.0)
    assert sight.seen.tolist() == [True, False, False, False]
    assert np.isfinite(sight.columns).all() and np.isfinite(sight.rows).all()


def test_tangential_distortion_bends_where_the_model_ends():
    # Along the row of the principal point, x + 3 p2 x^2 turns at x = -1 / (6 p2) = 0.83.
    camera = lens(BROWN, 0.0, 0.0, 0.0, -0.2, width=3000, cx=1500.0)
    sight = look(camera, [-1.5, 0.8, 0.9, 1.6], 0.0)
    assert sight.seen.tolist() == [True, True, False, False]


coefficient = st.floats(-1.0, 1.0)


@settings(max_examples=60, deadline=None)
@given(st.one_of(
    st.tuples(st.just(BROWN), st.tuples(
        coefficient, coefficient, st.just(0.0), st.just(0.0), coefficient)),
    st.tuples(st.just(BROWN), st.tuples(
        coefficient, coefficient, st.just(0.0), st.just(0.0), coefficient, coefficient,
        coefficient, coefficient)),
    st.tuples(st.just(FISHEYE), st.tuples(*[coefficient] * 4))),
    st.floats(0.0, 2 * math.pi))
def test_what_is_seen_lies_in_the_order_of_its_angle(model, turn):
    camera = lens(model[0], *model[1])
    r = np.tan(np.radians(np.linspace(0.0, 89.0, 300)))
    sight = look(camera, r * math.cos(turn), r * math.sin(turn))
    distance = np.hypot((sight.columns - 325) / 330, (sight.rows - 230) / 340)
    assert sight.seen[0] and distance[0] == pytest.approx(0.0)
    assert (np.diff(sight.seen.astype(int)) <= 0).all()
    # The end of what is sound is known to 0.2 degrees, where the picture hardly grows any more.
    assert (np.diff(distance[sight.seen]) > -1e-3).all()


@pytest.mark.parametrize(('wrong', 'message'), [
    ({'width': 0}, 'images of 0x480 pixels: give the size'),
    ({'height': -1}, '640x-1'),
    ({'fx': 0.0}, 'fx is 0.0: give a number of pixels above 0'),
    ({'fy': math.inf}, 'fy is inf'),
    ({'fy': 1e300}, 'at most 1e.09'),
    ({'cx': math.nan}, 'cx is nan: give a finite number of pixels'),
    ({'cy': math.inf}, 'cy is inf'),
    ({'coefficients': (0.1,)}, '1 distortion coefficients: give no coefficients for NONE'),
    ({'distortion': BROWN}, '0 distortion coefficients: give 4, 5, 8, 12 or 14'),
    ({'distortion': BROWN, 'coefficients': (0.1,) * 6}, '6 distortion coefficients'),
    ({'distortion': FISHEYE, 'coefficients': (0.1,) * 5}, 'give 4 coefficients for FISHEYE'),
    ({'distortion': FISHEYE, 'coefficients': (0.1, 0.0, math.nan, 0.0)}, 'give finite numbers'),
])
def test_refuses_what_cannot_be(wrong, message):
    with pytest.raises(ValueError, match=message):
        replace(PLAIN, **wrong)


@pytest.mark.parametrize('focal_px', [0.0, -1.0, math.nan, math.inf])
def test_refuses_a_focal_length_that_cannot_be(focal_px):
    with pytest.raises(ValueError, match=f'focal_px is {focal_px}'):
        CameraModel.pinhole((240, 320), focal_px)


@pytest.mark.parametrize(('changes', 'close'), [
    ({}, True), ({'fx': 400.2}, True), ({'cx': 320.2, 'cy': 239.9}, True),
    ({'fx': 401.0}, False), ({'cy': 241.0}, False), ({'width': 641}, False),
    ({'coefficients': (-0.1, 0.0, 0.0, 0.0, 0.001)}, False)])
def test_calibrations_that_tremble_are_the_same(changes, close):
    camera = CameraModel(
        width=640, height=480, fx=400.0, fy=400.0, cx=320.0, cy=240.0,
        distortion=Distortion.BROWN, coefficients=(-0.1, 0.0, 0.0, 0.0, 0.0))
    assert replace(camera, **changes).is_close_to(camera) is close


def test_a_pinhole_sees_as_far_across_as_its_focal_length_says():
    camera = CameraModel.pinhole((240, 400), 230.0)
    assert camera.hfov_deg == pytest.approx(math.degrees(2 * math.atan(200 / 230)))
    aside = replace(camera, cx=camera.cx + 40.0)
    assert aside.offset == pytest.approx(0.1)
    assert aside.hfov_deg == pytest.approx(
        math.degrees(math.atan(240 / 230) + math.atan(160 / 230)))


@pytest.mark.parametrize(('fx', 'hfov_deg'), [(320.0, math.degrees(2.0)), (100.0, 180.0)])
def test_a_fisheye_sees_farther_across_than_a_pinhole(fx, hfov_deg):
    assert lens(FISHEYE, 0.0, 0.0, 0.0, 0.0, fx=fx, cx=319.5).hfov_deg == pytest.approx(
        hfov_deg, abs=0.5)
