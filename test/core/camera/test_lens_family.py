# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Lenses from the pinhole to strong fisheyes."""

import math

from hypothesis import assume, example, given, strategies as st
import numpy as np
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.camera.lens_family import (
    angle_at,
    focal_px_of,
    OneNumberLens,
    project,
    projection_jacobians,
    radius,
    unproject,
)
from phase_traj_ros.core.camera.model import CameraModel, Distortion
import pytest

STRAIGHTNESS = st.floats(-1.0, 1.3)


@pytest.mark.parametrize(('straightness', 'known'), [
    (1.0, np.tan), (0.0, lambda a: a), (0.25, lambda a: 2 * np.tan(a / 2))])
def test_well_known_lenses_are_of_the_family(straightness, known):
    angle = np.linspace(0, 1.2, 50)
    np.testing.assert_allclose(radius(angle, straightness), known(angle), atol=1e-12)


def test_an_equisolid_fisheye_is_nearly_of_the_family():
    angle = np.linspace(0, math.radians(65), 50)
    assert abs(radius(angle, -1 / 8) - 2 * np.sin(angle / 2)).max() < 0.004


@given(STRAIGHTNESS, st.floats(0.0, 1.2))
def test_the_angle_undoes_the_radius(straightness, angle):
    seen = radius(np.array([angle]), straightness)
    assert angle_at(seen, straightness)[0] == pytest.approx(angle, abs=1e-9)


@given(STRAIGHTNESS, st.floats(-250, 250), st.floats(-150, 150))
def test_a_ray_is_seen_where_it_comes_from(straightness, column, row):
    place = np.array([[column, row]])
    # A place farther out is no direction's: it would lie more than half a turn off the axis.
    assume(angle_at(np.hypot(*place.T) / 250.0, straightness)[0] < 3.14)
    found = project(unproject(place, 250.0, straightness), 250.0, straightness)
    np.testing.assert_allclose(found, place, atol=1e-6)


@given(STRAIGHTNESS, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
@example(0.0, 0.0, 7.6e-10)
def test_the_derivatives_are_those_of_the_places(straightness, x, y):
    direction = np.array([[x, y, 1.1]])
    change = projection_jacobians(direction, 100.0, straightness)
    for axis in range(3):
        step = np.zeros((1, 3))
        step[0, axis] = 1e-6
        after, before = (
            project(direction + side * step, 100.0, straightness) for side in (1, -1))
        np.testing.assert_allclose(
            change[0, :, axis], (after - before)[0] / 2e-6, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize('straightness', [-0.5, 0.0, 0.25, 0.7, 1.2])
@pytest.mark.parametrize('hfov_deg', [70.0, 110.0, 150.0])
def test_the_model_sees_what_the_lens_sees(straightness, hfov_deg):
    focal_px = focal_px_of(hfov_deg, 320, straightness, column=0.0)
    lens = OneNumberLens(focal_px, straightness)
    model = CameraModel.of_lens(lens, (240, 320), column=7.0)
    columns, rows = np.meshgrid(np.linspace(2, 317, 9), np.linspace(60, 180, 7))
    directions = unproject(
        np.stack([columns.ravel() - 159.5 - 7.0, rows.ravel() - 119.5], axis=1), focal_px,
        straightness)
    sight = model.project(*directions.T)
    assert sight.seen.all()
    np.testing.assert_allclose(sight.columns, columns.ravel(), atol=1e-6)
    np.testing.assert_allclose(sight.rows, rows.ravel(), atol=1e-6)


def test_what_is_nearly_a_pinhole_is_one():
    model = CameraModel.of_lens(OneNumberLens(200.0, 1.01), (240, 320))
    assert model.distortion is Distortion.NONE
    assert (model.fx, model.cx) == (200.0, 159.5)


def test_the_field_of_view_is_from_edge_to_edge():
    assert OneNumberLens(160.0).hfov_deg(320) == pytest.approx(90.0)
    assert OneNumberLens(160.0, 0.0).hfov_deg(320) == pytest.approx(math.degrees(2.0))
    # The right half of a picture begins at its principal point.
    assert OneNumberLens(160.0).hfov_deg(160, column=-80.0) == pytest.approx(45.0)


@pytest.mark.parametrize('wrong', [(0.0, 1.0), (math.nan, 1.0), (100.0, 1.4), (100.0, -1.1)])
def test_what_is_no_lens_is_refused(wrong):
    with pytest.raises(ValueError, match='give a number'):
        OneNumberLens(*wrong)


@given(STRAIGHTNESS, st.floats(-0.45, 0.45), st.floats(0.35, 3.0))
def test_the_field_of_view_tells_the_focal_length_wherever_the_middle_is(
        straightness, offset, focal):
    lens = OneNumberLens(640 * focal, straightness)
    hfov_deg = lens.hfov_deg(640, column=640 * offset)
    beyond_all = math.sqrt(max(-straightness, 0.0)) * (0.5 + abs(offset)) / focal > 0.99
    assume(hfov_deg < 179.0 and not beyond_all)
    told = Lens(hfov_deg=hfov_deg, straightness=straightness, offset=offset)
    assert told.focal_for(640) == pytest.approx(640 * focal, rel=1e-4)
    assert told.hfov_for(640) == pytest.approx(hfov_deg)


def test_a_field_of_view_that_no_such_lens_has_is_refused():
    with pytest.raises(ValueError, match=r'hfov_deg is 170.0: .* less than 158 degrees'):
        Lens(hfov_deg=170.0, straightness=1.3)


def test_places_do_not_depend_on_where_their_buffers_lie():
    directions = np.random.default_rng(0).uniform((-1.0, -0.5, 0.5), (1.0, 0.5, 2.0), (200, 3))
    # After each copy a hole in memory, into which an array of one number a direction fits.
    copies, holes = zip(*((directions.copy(), np.empty(200)) for _ in range(50)))
    del holes
    assert len({project(each, 200.0, 0.5).tobytes() for each in copies}) == 1
