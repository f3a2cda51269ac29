# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Road that slides far between two frames, and is compared with where it comes from."""

import math

import numpy as np
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.road.ground import CELL, GroundPatch, stretches
from phase_traj_ros.core.road.keyframe import RoadKeyframe
from phase_traj_ros.core.road.meter import RoadMeter
from phase_traj_ros.core.road.patch_matcher import PatchMatcher
from phase_traj_ros.core.road.travel import TravelState
import pytest
from road_scene import LEVEL, motion, PINHOLE, Road, SURE, with_copies

DRIVEN = RoadKeyframe(0.1, passing=0.2, agreed=True)


def matcher(which=0, camera=PINHOLE, least_offset=1.0):
    return PatchMatcher(
        GroundPatch(camera, LEVEL, stretches(camera, LEVEL)[which]), least_offset=least_offset)


def found(patch, before, after, slide, *, expected, roll=0.0, tilt=0.0):
    """Return the slide that a matcher finds near one."""
    patch.restart(before, roll)
    patch.add(after)
    patch.compare(np.eye(3), expected)
    return patch.find(slide - 0.6, slide + 0.6, DRIVEN, tilt=tilt)


@pytest.mark.parametrize('step', [2.5, 3.5])
@pytest.mark.parametrize('copied', [False, True])
def test_road_that_slides_far_between_two_frames_is_found(copied, step):
    """The near patch is 3.8 long, the far one 5.5."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(pitch_deviation=0.005))
    pictures = (road.seen(step * index) for index in range(40))
    first, *others = with_copies(pictures) if copied else pictures
    meter.start(first)
    travels = [meter.update(picture, 0.1, motion(passing=0.1 * step)) for picture in others]
    late = travels[15:]
    measured = [travel.state for travel in late].count(TravelState.MEASURED)
    assert measured >= (20 if copied else len(late))
    assert np.mean([travel.distance for travel in late]) == pytest.approx(step, rel=0.01)
    assert not any(travel.rivalled for travel in late)


@pytest.mark.parametrize('faint', [True, False])
def test_a_faint_first_speed_that_the_road_refutes_later_was_noise(faint):
    """For ten pairs, the road seems to be slower. If faint, the far part of it shows nothing."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(pitch_deviation=0.005))
    rng = np.random.default_rng(0)
    ways = np.cumsum([0.0, *10 * [0.4], *20 * [2.5]])
    travels = []
    for index, way in enumerate(ways):
        frame = road.seen(way)
        if faint and index <= 10:
            frame[120:200] = rng.integers(90, 130, frame[120:200].shape)
        if index == 0:
            meter.start(frame)
            continue
        travels.append(meter.update(frame, 0.1, motion(passing=0.1)))
    assert travels[-1].distance == pytest.approx(2.5, rel=0.01)
    refuted = [(index, travel.refuted) for index, travel in enumerate(travels) if travel.refuted]
    assert len(refuted) == faint
    for index, seconds in refuted:
        # All pairs since the first measured one.
        assert seconds == pytest.approx(0.1 * index, abs=0.15)


def test_it_is_clearer_where_it_comes_from():
    road, patch = Road(PINHOLE), matcher()
    frames = road.seen(0.0), road.seen(1.9)
    in_place, ahead = (found(patch, *frames, 1.9, expected=each) for each in (0.0, 1.8))
    assert ahead.distance == pytest.approx(1.9, abs=CELL)
    assert ahead.score > 1.8 * in_place.score
    # Below the least offset, it is in place.
    assert found(patch, *frames, 1.9, expected=0.9).score == in_place.score
    assert (in_place.depth, ahead.depth) == (patch.depth, pytest.approx(patch.depth + 0.9))
    assert in_place.newest_depth == ahead.newest_depth == patch.depth


@pytest.mark.parametrize('roll', [-0.2, 0.1])
def test_under_a_vehicle_that_leans_as_well(roll):
    road, patch, errors = Road(PINHOLE), matcher(), []
    for start in range(6):
        frames = (road.seen(way, roll=roll) for way in (start, start + 2.4))
        slide = found(patch, *frames, 2.4, expected=2.4, roll=roll)
        errors.append(slide.distance - 2.4)
        assert slide.score > 15.0
    assert np.abs(errors).max() < 0.3 * CELL


def test_a_wrong_pitch_stretches_it_by_the_depth_of_both_patches():
    patch, tilt = matcher(), 0.004
    road = Road(PINHOLE, -tilt)
    slide = found(patch, road.seen(0.0), road.seen(2.4), 2.4, expected=2.4, tilt=-tilt)
    assert slide.distance == pytest.approx(slide.raw * math.exp(2.0 * slide.depth * tilt))
    assert slide.depth == pytest.approx(patch.depth + 1.2, abs=CELL)
    # Shorter by 5 % as seen; the near part of the patch, which is sharper, counts more.
    assert slide.raw < 0.96 * 2.4
    assert slide.distance == pytest.approx(2.4, rel=0.012)


def test_a_speed_that_is_wrong_is_corrected_where_the_road_is():
    """The second frame is stamped five times too early, so that the speed seems so much higher."""
    # Both patches can have an offset of 3.
    camera = CameraModel.pinhole((376, 1241), 719.0)
    road, meter = Road(camera), RoadMeter(camera, SURE)
    meter.start(road.seen(0.0))
    for index, interval in enumerate([0.02] + [0.1] * 8):
        travel = meter.update(
            road.seen(0.55 * (index + 1)), interval, motion(passing=0.06),
            interval_deviation=0.0067)
        assert travel.state is TravelState.MEASURED
        assert travel.distance == pytest.approx(0.55, abs=0.1)


@pytest.mark.parametrize('focal', [370.0, 402.0, 420.0])
def test_an_unknown_slide_is_searched_as_far_as_without_an_offset(focal):
    """The camera does not resolve the road more than 0.2 to 1.2 beyond the far patch."""
    camera = CameraModel.pinhole((240, 640), focal)
    patch = matcher(1, camera)
    rng = np.random.default_rng(0)
    patch.restart(rng.integers(0, 255, camera.shape).astype(np.uint8))
    for _ in range(2):
        patch.add(rng.integers(0, 255, camera.shape).astype(np.uint8))
    begin, end = stretches(camera, LEVEL)[1]
    ways = np.arange(0.3, 0.68 * (end - begin), 0.1)
    assert np.isfinite(patch.scores_of_changes(ways, np.eye(3), tilt=0.0)).all()
