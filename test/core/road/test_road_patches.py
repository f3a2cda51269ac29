# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The patches of the road that a camera sees, and how they add up."""

import math

import numpy as np
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.road.ground import CELL, GroundPatch, stretches
from phase_traj_ros.core.road.meter import RoadMeter
from phase_traj_ros.core.road.travel import TravelState
from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion
import pytest
from road_scene import drive, LEVEL, motion, PINHOLE, Road, SURE


def test_two_patches_cover_a_near_and_a_far_stretch():
    (near_begin, near_end), (far_begin, far_end) = stretches(PINHOLE, LEVEL)
    assert 2.0 < near_begin < far_begin < near_end < far_end <= 10.0


@pytest.mark.parametrize('focal', [250.0, 370.0, 600.0])
def test_a_patch_ends_where_a_row_covers_too_much(focal):
    """Rows lie at f / z below the horizon, so one covers z**2 / f."""
    _, far_end = stretches(CameraModel.pinhole((480, 640), focal), LEVEL)[-1]
    assert far_end ** 2 / focal == pytest.approx(min(0.3, 10.0 ** 2 / focal), rel=0.02)


@pytest.mark.parametrize(('focal', 'patches'), [(34.0, 0), (60.0, 2)])
def test_a_few_rows_of_the_image_are_not_a_patch(focal, patches):
    """Between the distances a and b, there are f / a - f / b rows."""
    rows = focal / 1.5 - math.sqrt(0.3 * focal)
    assert (rows > 20.0) == bool(patches)
    assert len(stretches(CameraModel.pinhole((120, 160), focal), LEVEL)) == patches


@pytest.mark.parametrize('focal', [250.0, 600.0])
def test_a_patch_is_as_blurred_as_the_rows_in_its_middle_are_apart(focal):
    camera = CameraModel.pinhole((480, 640), focal)
    both = stretches(camera, LEVEL)
    assert len(both) == 2
    for stretch in both:
        middle = sum(stretch) / 2
        # Interpolation between two rows is a triangle with the variance 1/6, in both pictures.
        blur = math.sqrt(2 / 6) * middle ** 2 / focal
        assert GroundPatch(camera, LEVEL, stretch).blur_cells * CELL == pytest.approx(
            blur, rel=0.05)


def test_a_camera_that_sees_only_one_side_of_its_axis_has_patches():
    camera = CameraModel(width=640, height=480, fx=300.0, fy=300.0, cx=639.0, cy=239.5)
    found = [GroundPatch(camera, LEVEL, each) for each in stretches(camera, LEVEL)]
    assert len(found) == 2
    assert all(0.3 < patch.blur_cells < 3.0 and patch.share < 0.6 for patch in found)


def test_the_share_of_a_patch_is_what_is_seen_of_it():
    mask = np.ones(PINHOLE.shape, np.float32)
    stretch = stretches(PINHOLE, LEVEL)[0]
    whole = GroundPatch(PINHOLE, LEVEL, stretch, mask=mask).share
    mask[:, :320] = 0.0
    assert 0.8 < whole <= 1.0
    assert GroundPatch(PINHOLE, LEVEL, stretch, mask=mask).share == pytest.approx(
        0.5 * whole, rel=0.1)


def test_a_camera_that_sees_no_road_has_none():
    assert stretches(CameraModel.pinhole((60, 640), 1500.0), LEVEL) == ()
    travels = drive(PINHOLE, 0.5, told=-0.5)
    assert {travel.state for travel in travels} == {TravelState.UNKNOWN}


def test_the_near_and_the_far_road_tell_the_pitch_as_surely_as_they_say():
    """Nothing else tells it, and each frame nods by what the blocks do not see."""
    rng, blind = np.random.default_rng(4), FocusOfExpansion(slope=0.0, slope_variance=4.0)
    errors = []
    for pitch in np.radians(np.linspace(-1.5, 1.5, 7)):
        road = Road(PINHOLE, pitch)
        meter = RoadMeter(PINHOLE, Horizon(pitch_deviation=math.radians(1.5)))
        meter.start(road.seen(0.0))
        for index in range(1, 16):
            meter.update(
                road.seen(0.5 * index, pitch=0.0004 * rng.normal()), 0.1,
                CameraMotion(0.0, 0.0, 0.0, blind, 100.0, 1.0, 1e-8, 0.05, near=0.05))
        assert meter.pitch.deviation < math.radians(0.5)
        errors.append((meter.pitch.current - pitch) / meter.pitch.deviation)
    assert 0.2 < np.sqrt(np.mean(np.square(errors))) < 1.5


def test_an_error_of_the_pitch_counts_by_twice_the_distance_of_the_road():
    near, far = stretches(PINHOLE, LEVEL)
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon())
    meter.start(road.seen(0.0))
    travel = meter.update(road.seen(0.5), 0.1, motion())
    for share, deviation in ((travel.swing, meter.pitch.swing_deviation),
                             (travel.tilt, meter.pitch.common_deviation)):
        assert near[0] < share / deviation / 2.0 < far[1]
    # The rest is that of the peak.
    assert 0.0 < math.sqrt(travel.own_variance) < CELL


def test_two_patches_that_disagree_are_not_averaged():
    """As with something else on the far road: the better one counts alone."""
    for split in (190, 200):
        road, meter = Road(PINHOLE), RoadMeter(PINHOLE, SURE)
        for index in range(12):
            frame = road.seen(0.5 * index)
            frame[:split] = road.seen(40.0 + 0.25 * index)[:split]
            if index == 0:
                meter.start(frame)
                continue
            distance = meter.update(frame, 0.1, motion()).distance
            assert min(abs(distance - 0.5), abs(distance - 0.25)) < CELL


@pytest.mark.parametrize('roll', [0.0, 0.15])
@pytest.mark.parametrize('which', [0, 1])
def test_a_patch_with_an_offset_shows_what_will_be_in_it(which, roll):
    road = Road(PINHOLE)
    patch = GroundPatch(PINHOLE, LEVEL, stretches(PINHOLE, LEVEL)[which])
    for offset in (0, patch.max_offset // 2, patch.max_offset):
        ahead = patch.derotated(
            patch(road.seen(0.0, roll=roll), offset), np.eye(3), roll, offset)
        assert ahead.shape == patch.shape
        agreement = [
            np.corrcoef((patch.window * ahead).ravel(),
                        (patch.window * patch(road.seen(CELL * (offset + error)))).ravel())[0, 1]
            for error in (0, 5)]
        assert agreement[0] > 0.6 and abs(agreement[1]) < 0.3


@pytest.mark.parametrize(('focal', 'near', 'far'), [(370.0, 3.0, 0.5), (1200.0, 3.0, 3.0)])
def test_an_offset_ends_where_the_rows_are_too_far_apart(focal, near, far):
    camera = CameraModel.pinhole((720, 1280) if focal > 1000.0 else (240, 640), focal)
    offsets = [GroundPatch(camera, LEVEL, each).max_offset * CELL
               for each in stretches(camera, LEVEL)]
    assert offsets == pytest.approx([near, far], abs=CELL)


def test_a_patch_is_the_same_in_any_light():
    """Half as bright, with half the contrast, or with a shadow over a part of it."""
    road = Road(PINHOLE).seen(0.0)
    patch = GroundPatch(PINHOLE, LEVEL, stretches(PINHOLE, LEVEL)[0])
    bright = patch(road)
    inner = patch.window > 0.3
    for light in (0.5, 2.0, np.linspace(0.6, 1.6, road.shape[1])):
        seen = patch(np.clip(np.float32(40.0) + 0.7 * light * (road - 60.0), 0, 255))
        assert np.std((seen - bright)[inner]) < 0.15 * np.std(bright[inner])
