# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What does not move with the road: reflections, frozen pictures, and copies of an encoder."""

from types import SimpleNamespace

import cv2
import numpy as np
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.road.ground import CELL, GroundPatch, rotation, stretches
from phase_traj_ros.core.road.keyframe import RoadKeyframe
from phase_traj_ros.core.road.meter import RoadMeter
from phase_traj_ros.core.road.patch_matcher import PatchMatcher
from phase_traj_ros.core.road.travel import TravelState
import pytest
from road_scene import drive, LEVEL, motion, NOISE, PINHOLE, Road, SURE, with_copies


@pytest.mark.parametrize('step', [0.2, 0.7])
def test_a_reflection_that_is_stronger_than_the_road_does_not_stop_the_vehicle(step):
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(pitch_deviation=0.005))
    rng = np.random.default_rng(1)
    shine = cv2.GaussianBlur(rng.normal(size=PINHOLE.shape).astype(np.float32), (0, 0), 2.0)
    shine = np.float32(8) * shine / shine.std()
    pictures = [np.clip(road.seen(index * step) + shine, 0, 255).astype(np.uint8)
                for index in range(12)]
    meter.start(pictures[0])
    # The horizon hardly moves, as far away as it is on a motorway.
    travels = [meter.update(picture, 0.04, motion(passing=0.006)) for picture in pictures[1:]]
    assert sum(travel.distance for travel in travels[1:]) == pytest.approx(10 * step, rel=0.05)


def test_a_reflection_stays_out_though_the_springs_move_the_road_under_it():
    # Compensated for the pitch, the reflection slides, and the road is weaker than it at first.
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(pitch_deviation=0.005))
    rng = np.random.default_rng(2)
    shine = cv2.GaussianBlur(rng.normal(size=PINHOLE.shape).astype(np.float32), (0, 0), 2.0)
    shine = np.float32(12) * shine / shine.std()
    nods = 0.004 * np.sin(np.arange(40))
    pictures = [
        np.clip(road.seen(0.6 * index, pitch=nod) + shine, 0, 255).astype(np.uint8)
        for index, nod in enumerate(nods)]
    meter.start(pictures[0])
    travels = [meter.update(picture, 0.04, motion(pitch=before - after, passing=0.006))
               for picture, before, after in zip(pictures[1:], nods, nods[1:])]
    late = travels[15:]
    assert {travel.state for travel in late} <= {TravelState.MEASURED, TravelState.BRIDGED}
    assert np.mean([travel.distance for travel in late]) == pytest.approx(0.6, rel=0.05)


def test_the_road_is_measured_through_copies_that_are_renewed_too_often_for_a_mean():
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(pitch_deviation=0.005))
    first, *others = with_copies(road.seen(0.5 * index) for index in range(40))
    meter.start(first)
    travels = [meter.update(picture, 0.04, motion(passing=0.012)) for picture in others]
    late = travels[15:]
    assert {travel.state for travel in late} == {TravelState.MEASURED}
    assert np.mean([travel.distance for travel in late]) == pytest.approx(0.5, rel=0.03)


@pytest.mark.parametrize('yaw', [0.0, 0.06])
def test_what_changes_from_frame_to_frame_is_the_road(yaw):
    road, patch = Road(PINHOLE), GroundPatch(
        PINHOLE, LEVEL, stretches(PINHOLE, LEVEL)[0])
    matcher, slides = PatchMatcher(patch, least_offset=1.0), np.arange(10) * 0.1
    pictures = list(with_copies(
        road.seen(0.5 * index, yaw=yaw * index) for index in range(3)))
    for number, picture in enumerate(pictures):
        scores = matcher.scores_of_changes(slides, np.eye(3), tilt=0.0)
        assert np.isnan(scores).all()
        (matcher.add if number else matcher.restart)(picture)
    matcher.compare(np.eye(3))
    assert matcher.is_rivalled(None)
    scores = matcher.scores_of_changes(slides, rotation(yaw, 0.0, 0.0), tilt=0.0)
    assert slides[scores.argmax()] == 0.5
    matcher.restart(pictures[0])
    assert np.isnan(matcher.scores_of_changes(slides, np.eye(3), tilt=0.0)).all()


def test_what_does_not_move_with_the_world_is_no_road():
    def pattern(_, frame):
        frame[frame.shape[0] * 3 // 5:] = NOISE[:frame.shape[0] * 2 // 5, :frame.shape[1]]

    travels = drive(PINHOLE, 0.5, spoil=pattern)
    assert all(travel.state is not TravelState.STANDING for travel in travels)
    mask = np.ones(PINHOLE.shape, np.float32)
    mask[190:] = 0.0

    def bonnet(_, frame):
        frame[190:] = NOISE[:50, :frame.shape[1]]

    travels = drive(PINHOLE, 0.5, spoil=bonnet, mask=mask)
    assert np.mean([travel.distance for travel in travels]) == pytest.approx(0.5, rel=0.03)


@pytest.mark.parametrize('pitch', [-0.01, 0.01])
def test_a_picture_that_stays_while_the_camera_nods_is_fixed_to_it(pitch):
    """With the nod taken out, it slides; what slides to the other side is the road."""
    frame = Road(PINHOLE).seen(0.0)
    matcher = PatchMatcher(
        GroundPatch(PINHOLE, LEVEL, stretches(PINHOLE, LEVEL)[0]), least_offset=1.0)
    matcher.add(frame)
    matcher.set_reference()
    matcher.add(frame)
    matcher.compare(rotation(0.0, pitch, 0.0))
    found, other = (
        matcher.find(-1.0, 1.0, RoadKeyframe(0.1, nod=nodded, agreed=True), tilt=0.0)
        for nodded in (pitch, -pitch))
    assert found.fixed and not other.fixed
    assert abs(found.raw) > CELL and found.raw * pitch < 0.0


class Flat(SimpleNamespace):
    """Takes frames for patches."""

    shape, window, depth = (80, 60), np.ones((80, 60), np.float32), 3.0
    blur_cells, max_offset = 0.0, 0

    def __call__(self, frame, offset):
        return frame

    def derotated(self, patch, *_):
        return patch


@pytest.mark.parametrize(('learned', 'shown'), [(0, True), (1, True), (2, True), (12, False)])
def test_what_three_patches_share_is_taken_out(learned, shown):
    rng = np.random.default_rng(0)
    shine, *roads = rng.normal(size=(learned + 3, *Flat.shape)).astype(np.float32)
    matcher = PatchMatcher(Flat(), least_offset=1.0)
    for road in roads[2:]:
        matcher.add(road + shine)
        matcher.learn()
    matcher.add(roads[0] + shine)
    matcher.set_reference()
    matcher.add(roads[1] + shine)
    matcher.compare(np.eye(3))
    assert matcher.is_rivalled(None) == shown


def test_a_part_of_the_road_that_stands_is_a_rival_of_the_rest():
    """An encoder copies it from the frame before, while everything else shows that it moves."""
    road = Road(PINHOLE)
    frames = [road.seen(0.3 * index) for index in range(20)]
    told = []
    for share in (0.0, 0.75):
        meter = RoadMeter(PINHOLE, SURE)
        meter.start(frames[0])
        last = round(640 * share)
        travels = []
        for frame in frames[1:]:
            shown = frame.copy()
            shown[:, :last] = frames[0][:, :last]
            travels.append(meter.update(shown, 0.1, motion()))
        told.append(np.mean([travel.rivalled for travel in travels]))
    assert told[0] == 0.0 and told[1] > 0.5


def test_a_picture_that_freezes_for_a_moment_does_not_stop_a_fast_vehicle():
    """The blocks of a single pair may show no motion, as may its road; tyres do not brake so."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, SURE)
    meter.start(road.seen(0.0))
    for index in range(1, 10):
        meter.update(road.seen(0.5 * index), 0.04, motion())
    frozen = meter.update(road.seen(4.5), 0.04, motion(passing=0.0))
    assert frozen.state is TravelState.BRIDGED
    after = meter.update(road.seen(5.5), 0.04, motion())
    assert after.state is TravelState.MEASURED
    assert frozen.distance + after.distance == pytest.approx(1.0, rel=0.02)
    # What does not move for long stands.
    stays = [meter.update(road.seen(5.5), 0.04, motion(passing=0.0)) for _ in range(12)]
    assert stays[-1].state is TravelState.STANDING


def test_copies_do_not_stop_a_vehicle_however_wrong_the_stamps_are():
    """In two pairs, an encoder copies all of the road, and the blocks are far away."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, SURE)
    meter.start(road.seen(0.0))
    ways = []
    for index in range(1, 31):
        shown = 12 if index in (13, 14) else index
        ways.append(meter.update(
            road.seen(0.25 * shown), 0.04, motion(passing=0.003), interval_deviation=0.016
        ).distance)
    assert ways == pytest.approx([0.25] * 30, abs=CELL)


def test_what_shows_beside_a_copy_is_not_the_road():
    """Most is copied from the frame before, and the rest has moved by less than lobes reach."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, SURE)
    meter.start(road.seen(0.0))
    for place in 7.0 * np.arange(1, 8):
        new, copied = road.seen(place), road.seen(place)
        copied[:, 300:340] = road.seen(place + 0.15)[:, 300:340]
        for frame in (new, copied):
            travel = meter.update(frame, 0.04, motion())
            assert travel.state is not TravelState.MEASURED


def test_reverse_is_told_beside_a_copy():
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, SURE)
    meter.start(road.seen(20.0))
    copied = road.seen(20.0)
    copied[:, 250:390] = road.seen(19.64)[:, 250:390]
    travel = meter.update(copied, 0.3, None, yaw=0.0)
    assert travel.state is TravelState.MEASURED
    assert travel.distance == pytest.approx(-0.36, abs=CELL)


def test_a_reflection_far_stronger_than_the_road_is_learned_and_taken_out():
    """The horizon hardly moves, as on a motorway; that the road slides tells that it drives."""
    missed = 0
    for seed in (2, 3, 4):
        road, meter = Road(PINHOLE), RoadMeter(PINHOLE, SURE)
        rng = np.random.default_rng(seed)
        shine = cv2.GaussianBlur(rng.normal(size=PINHOLE.shape).astype(np.float32), (0, 0), 2.0)
        shine = np.float32(25) * shine / shine.std()
        travels = []
        for index in range(25):
            faint = 60.0 + 0.4 * road.seen(0.6 * index) + shine + rng.normal(size=PINHOLE.shape)
            picture = np.clip(faint, 0, 255).astype(np.uint8)
            if index == 0:
                meter.start(picture)
            else:
                travels.append(meter.update(picture, 0.04, motion(passing=0.006)))
        late = [travel for travel in travels[10:] if travel.state is TravelState.MEASURED]
        assert [travel.distance for travel in late] == pytest.approx([0.6] * len(late), rel=0.05)
        missed += 14 - len(late)
    assert missed <= 2


def test_a_patch_that_shows_what_is_fixed_leaves_the_way_to_the_other():
    """A bonnet covers the near road; that the far road slides tells that the vehicle drives."""
    road, meter, ways = Road(PINHOLE), RoadMeter(PINHOLE, SURE), []
    for index in range(6):
        frame = road.seen(0.5 * index)
        frame[195:] = NOISE[:45, :640]
        if index == 0:
            meter.start(frame)
        else:
            ways.append(meter.update(frame, 0.1, motion(passing=0.006)).distance)
    assert ways == pytest.approx([0.5] * 5, abs=CELL)
