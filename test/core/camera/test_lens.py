# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is known of a camera, from where, and how it is told."""

from dataclasses import replace
import math

import numpy as np
from phase_traj_ros.core import CameraEstimate, CameraInUse, Lens, LensOrigin
from phase_traj_ros.core.camera.model import CameraModel, Distortion
from phase_traj_ros.errors import FrameError
import pytest

SHAPE = (240, 320)
MODEL = CameraModel(width=320, height=240, fx=200.0, fy=201.0, cx=150.0, cy=120.0)
ESTIMATE = CameraEstimate(
    width=320, height=240, focal_px=160.0, focal_deviation=0.04, straightness=0.5,
    column_px=8.0, pitch_deg=5.0, roll_deg=-60.0, turns=3)


@pytest.mark.parametrize(('lens', 'origin', 'focal'), [
    (Lens(focal_px=300.0), LensOrigin.GIVEN, 300.0),
    (Lens(hfov_deg=90.0), LensOrigin.GIVEN, 160.0),
    (Lens(hfov_deg=90.0, assumed=True), LensOrigin.ASSUMED, 160.0),
    (Lens(camera=MODEL), LensOrigin.CALIBRATION, 200.0),
    (Lens(estimate=ESTIMATE), LensOrigin.DRIVE, 160.0),
    # The first that there is counts.
    (Lens(focal_px=300.0, hfov_deg=90.0, camera=MODEL, estimate=ESTIMATE), LensOrigin.GIVEN, 300),
    (Lens(hfov_deg=90.0, camera=MODEL, estimate=ESTIMATE), LensOrigin.GIVEN, 160.0),
    (Lens(camera=MODEL, estimate=ESTIMATE), LensOrigin.CALIBRATION, 200.0),
])
def test_where_it_comes_from_and_what_it_says(lens, origin, focal):
    assert lens.origin is origin
    assert lens.focal_for(320) == pytest.approx(focal)
    assert (lens.camera is MODEL) == (origin is LensOrigin.CALIBRATION)
    assert CameraInUse.of(lens, 320).origin is origin


@pytest.mark.parametrize(('lens', 'factor'), [
    # Pixels stay pixels; angles and estimates go with the width.
    (Lens(focal_px=300.0), 1.0), (Lens(hfov_deg=90.0), 2.0), (Lens(estimate=ESTIMATE), 2.0),
    (Lens(hfov_deg=120.0, straightness=0.2, offset=0.1), 2.0)])
def test_frames_of_another_width(lens, factor):
    assert lens.focal_for(640) == pytest.approx(factor * lens.focal_for(320))
    model, larger = lens.camera_for(SHAPE), lens.camera_for((480, 640))
    assert larger.fx == pytest.approx(factor * model.fx)
    assert (larger.cx + 0.5) / 640 == pytest.approx((model.cx + 0.5) / 320)
    used, twice = (CameraInUse.of(lens, width) for width in (320, 640))
    assert twice.focal_px == pytest.approx(factor * used.focal_px)
    assert twice.offset == used.offset
    if used.interval_px is not None:
        assert twice.interval_px == pytest.approx([2 * end for end in used.interval_px])
        assert used.interval_px[0] < 160.0 < used.interval_px[1]


@pytest.mark.parametrize('straightness', [1.0, 0.5, 0.0, -0.3])
@pytest.mark.parametrize('offset', [0.0, 0.05, -0.4])
def test_a_field_of_view_goes_from_edge_to_edge_wherever_the_middle_is(straightness, offset):
    lens = Lens(hfov_deg=100.0, straightness=straightness, offset=offset)
    assert lens.hfov_for(320) == pytest.approx(100.0, abs=1e-6)
    model = lens.camera_for(SHAPE)
    assert model.cx == pytest.approx(159.5 + 320 * offset)
    if straightness == 1.0:
        edges = np.array([-0.5 - model.cx, 319.5 - model.cx]) / model.fx
        assert np.degrees(np.ptp(np.arctan(edges))) == pytest.approx(100.0)
    else:
        assert model.distortion is Distortion.ONE_NUMBER


def test_a_calibration_is_for_frames_of_its_size():
    assert Lens(camera=MODEL).camera_for(SHAPE) == MODEL
    with pytest.raises(FrameError, match='320x240'):
        Lens(camera=MODEL).camera_for((480, 640))


def test_the_tilt_is_the_share_of_a_turn_that_is_seen():
    assert Lens(focal_px=300.0).tilt == 1.0
    given = Lens(focal_px=300.0, pitch_deg=-60.0)
    assert given.tilt == pytest.approx(0.5)
    # Of an estimate it is its own that counts.
    told = Lens(estimate=ESTIMATE, pitch_deg=40.0)
    assert told.tilt == pytest.approx(0.5 * math.cos(math.radians(5.0)))
    assert CameraInUse.of(told, 320).pitch_deg == 5.0
    assert CameraInUse.of(given, 320).pitch_deg == -60.0


@pytest.mark.parametrize(('other', 'close'), [
    ({'focal_px': 160.5}, True), ({'focal_px': 164.0}, False), ({'straightness': 0.52}, True),
    ({'straightness': 0.6}, False), ({'column_px': 9.0}, True), ({'column_px': 14.0}, False),
    ({'roll_deg': -60.1}, True), ({'roll_deg': -58.0}, False)])
def test_lenses_that_make_no_difference(other, close):
    lens, changed = Lens(estimate=ESTIMATE), Lens(estimate=replace(ESTIMATE, **other))
    assert lens.is_close_to(changed, 640) == changed.is_close_to(lens, 640) == close


@pytest.mark.parametrize(('values', 'message'), [
    ({}, 'give one of them'), ({'focal_px': -1.0}, 'focal_px is -1'),
    ({'hfov_deg': 180.0}, 'hfov_deg is 180'), ({'focal_px': 9.0, 'pitch_deg': 61.0}, 'pitch_deg'),
    ({'focal_px': 9.0, 'roll_deg': math.nan}, 'roll_deg'),
    ({'focal_px': 9.0, 'offset': 0.6}, 'offset is 0.6'),
    ({'focal_px': 9.0, 'straightness': 3.0}, 'straightness')])
def test_what_cannot_be(values, message):
    with pytest.raises(ValueError, match=message):
        Lens(**values)


@pytest.mark.parametrize(('lens', 'words'), [
    (Lens(hfov_deg=90.0), 'field of view 90 degrees, focal length 160 px, from the parameters'),
    (Lens(camera=MODEL), 'focal length 200 px, from the calibration'),
    (Lens(hfov_deg=75.0, assumed=True),
     'field of view 75 degrees, focal length 208.5 px, assumed until a turn determines it'),
    (Lens(estimate=replace(ESTIMATE, straightness=1.0, column_px=0.0, focal_deviation=0.1)),
     'field of view 90 degrees, focal length 160 px (90 %: 135.7 to 188.6), learned from'
     ' 3 parts of turns; pitch 5.0 deg down'),
    (Lens(estimate=replace(ESTIMATE, straightness=1.0, column_px=0.0, focal_deviation=0.1,
                           turns=1, pitch_deg=-12.0)),
     'field of view 90 degrees, focal length 160 px (90 %: 135.7 to 188.6), learned from'
     ' 1 part of a turn; pitch 12.0 deg up'),
])
def test_in_words(lens, words):
    assert str(CameraInUse.of(lens, 320)) == words


def test_the_words_are_printed_whole():
    wide = replace(
        ESTIMATE, straightness=0.2, column_px=0.0, focal_px=811.1, focal_deviation=0.1,
        turns=111, pitch_deg=-12.0)
    assert len(str(CameraInUse.of(Lens(estimate=wide), ESTIMATE.width))) <= 128


def test_distances_on_the_road_are_proportional_to_the_focal_length():
    narrow, wide = Lens(hfov_deg=60.0), Lens(hfov_deg=90.0)
    assumed = Lens(hfov_deg=90.0, assumed=True)
    assert narrow.focal_ratio(assumed, 320) == pytest.approx(math.sqrt(3.0))
    assert Lens(focal_px=100.0).focal_ratio(Lens(estimate=ESTIMATE), 320) == pytest.approx(0.625)
    # A calibration may be for the next images, of another size: here of half the width.
    half = replace(MODEL, width=160, height=120, fx=0.5 * MODEL.fx, fy=0.5 * MODEL.fy)
    whole, other = Lens(camera=MODEL), Lens(camera=half)
    assert other.focal_ratio(assumed, 320) == pytest.approx(whole.focal_ratio(assumed, 320))
    # What was given before is right for its images, as with a zoom lens.
    assert narrow.focal_ratio(wide, 320) == other.focal_ratio(whole, 320) == 1.0


def test_only_an_estimate_says_how_sure_it_is():
    told = CameraInUse.of(Lens(estimate=ESTIMATE), 320)
    assert (told.turns, told.probability) == (3, ESTIMATE.probability)
    for lens in (Lens(focal_px=9.0), Lens(camera=MODEL), Lens(hfov_deg=75.0, assumed=True)):
        used = CameraInUse.of(lens, 320)
        assert (used.interval_px, used.probability, used.turns) == (None, None, None)
