# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A road as a plane of noise, seen by cameras that move over it."""

from itertools import pairwise
import math

import cv2
import numpy as np
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.lens_family import OneNumberLens
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.road.ground import CELL, GroundPatch, rotation, stretches
from phase_traj_ros.core.road.keyframe import Turned
from phase_traj_ros.core.road.look import RoadLook
from phase_traj_ros.core.road.meter import RoadMeter
from phase_traj_ros.core.road.slide import Slide
from phase_traj_ros.core.road.travel import TravelState
from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion
import pytest

PINHOLE = CameraModel.pinhole((240, 640), 370.0)
FISHEYE = CameraModel.of_lens(OneNumberLens(220.0, 0.0), (400, 640))
NOISE = cv2.GaussianBlur(
    np.random.default_rng(0).normal(size=(4096, 1024)).astype(np.float32), (0, 0), 1.5)
NOISE = np.clip(110 + 14 * NOISE / NOISE.std(), 0, 255).astype(np.uint8)
PER_HEIGHT = 40.0


class Road:
    """Pictures of a plane one unit below a camera; heights and radians, REP 103."""

    def __init__(self, camera, pitch=0.0):
        self.shape = camera.shape
        rows, columns = np.indices(camera.shape, np.float64)
        # The directions of the pixels, by looking them up the other way round.
        if camera is PINHOLE:
            x, y = (columns - camera.cx) / camera.fx, (rows - camera.cy) / camera.fy
            self.rays = np.stack([x, y, np.ones_like(x)], axis=-1)
        else:
            angle = np.hypot(columns - camera.cx, rows - camera.cy) / camera.fx
            along = np.arctan2(rows - camera.cy, columns - camera.cx)
            self.rays = np.stack([
                np.sin(angle) * np.cos(along), np.sin(angle) * np.sin(along), np.cos(angle)],
                axis=-1)
        self.pitch = pitch

    def seen(self, x, y=0.0, yaw=0.0, pitch=0.0, roll=0.0):
        levelling = Horizon(self.pitch + pitch, roll).levelling()
        level = self.rays @ levelling.T
        below = level[..., 1] > 0.02
        down = np.where(below, level[..., 1], 1.0)
        ahead, left = level[..., 2] / down, -level[..., 0] / down
        cosine, sine = math.cos(yaw), math.sin(yaw)
        way = x + cosine * ahead - sine * left
        aside = y + sine * ahead + cosine * left
        frame = cv2.remap(
            NOISE, (512 + PER_HEIGHT * aside).astype(np.float32),
            (PER_HEIGHT * way + 100).astype(np.float32), cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_WRAP)
        frame[~below] = 90
        return frame


def motion(yaw=0.0, pitch=0.0, *, slope=0.0, passing=0.05):
    return CameraMotion(
        yaw, pitch, 0.0, FocusOfExpansion(slope=slope, slope_variance=0.004 ** 2), 100.0, 1.0,
        1e-8, passing, near=passing)


def drive(camera, step, *, pitch=0.0, told=None, frames=12, spoil=None, **kwargs):
    road = Road(camera, pitch)
    meter = RoadMeter(camera, Horizon(0.0 if told is None else told), **kwargs)
    travels = []
    for index in range(frames):
        frame = road.seen(index * step)
        if spoil is not None:
            spoil(index, frame)
        if index == 0:
            meter.start(frame)
            continue
        travels.append(meter.update(
            frame, 0.1, motion(slope=-math.tan(pitch), passing=max(0.1 * step, 0.0))))
    return travels


@pytest.mark.parametrize('camera', [PINHOLE, FISHEYE])
@pytest.mark.parametrize('step', [0.1, 0.5, 1.3])
def test_the_way_is_that_of_the_road(camera, step):
    travels = drive(camera, step, pitch=0.03)
    assert {travel.state for travel in travels} == {TravelState.MEASURED}
    assert np.mean([travel.distance for travel in travels]) == pytest.approx(
        step, rel=0.02, abs=0.1 * CELL)
    for travel in travels:
        assert abs(travel.distance - step) < 3.0 * math.sqrt(travel.variance)


def test_two_patches_cover_a_near_and_a_far_stretch():
    near, far = stretches(PINHOLE, Horizon())
    assert 2.0 < near.begin < far.begin < near.end < far.end <= 10.0


@pytest.mark.parametrize('focal', [250.0, 370.0, 600.0])
def test_a_patch_ends_where_a_row_covers_too_much(focal):
    """Rows lie at f / z below the horizon, so one covers z**2 / f."""
    far = stretches(CameraModel.pinhole((480, 640), focal), Horizon())[-1]
    assert far.end ** 2 / focal == pytest.approx(min(0.13, 10.0 ** 2 / focal), rel=0.02)


def test_the_share_of_a_patch_is_what_is_seen_of_it():
    mask = np.ones(PINHOLE.shape, np.float32)
    stretch = stretches(PINHOLE, Horizon())[0]
    whole = GroundPatch(PINHOLE, Horizon(), stretch, mask=mask).share
    mask[:, :320] = 0.0
    assert 0.8 < whole <= 1.0
    assert GroundPatch(PINHOLE, Horizon(), stretch, mask=mask).share == pytest.approx(
        0.5 * whole, rel=0.1)


def test_a_camera_that_sees_no_road_has_none():
    assert stretches(CameraModel.pinhole((60, 640), 1500.0), Horizon()) == ()
    travels = drive(PINHOLE, 0.5, told=-0.5, pitch_known=True)
    assert {travel.state for travel in travels} == {TravelState.UNKNOWN}


def test_a_pitch_that_is_given_wrong_is_believed_but_for_what_the_springs_may_do():
    right, little, much = (
        np.mean([travel.distance for travel in drive(
            PINHOLE, 0.5, pitch=0.02, told=told, pitch_known=True, frames=8)])
        for told in (0.02, 0.03, 0.08))
    assert right == pytest.approx(0.5, rel=0.015)
    assert little == pytest.approx(0.5, rel=0.03)
    assert much < 0.95 * 0.5


@pytest.mark.parametrize(('yaw', 'pitch', 'roll'), [
    (0.06, 0.0, 0.0), (-0.06, 0.0, 0.0), (0.0, 0.008, 0.0), (0.0, 0.0, 0.03)])
def test_rotation_is_taken_out(yaw, pitch, roll):
    road = Road(PINHOLE)
    patch = GroundPatch(PINHOLE, Horizon(), stretches(PINHOLE, Horizon())[0])
    slide = Slide(patch.window)
    slide.keep(patch(road.seen(0.0)))
    # Seen from a camera that has turned up by the pitch (nose down is positive).
    turned = patch(road.seen(0.6, yaw=yaw, pitch=-pitch, roll=roll))
    slide.compare(patch.turned_back(turned, rotation(yaw, pitch, roll)))
    with_it = slide.peak(0, slide.most)
    slide.compare(turned)
    assert with_it.cells * CELL == pytest.approx(0.6, rel=0.02)
    assert with_it.score > 12.0


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


def test_it_stands_where_the_road_does_and_goes_exactly_nowhere():
    road = Road(PINHOLE)
    meter = RoadMeter(PINHOLE, Horizon(pitch_deviation=0.005))
    meter.start(road.seen(0.0))
    travels = [meter.update(road.seen(0.0), 0.1, motion(passing=0.0)) for _ in range(40)]
    # It takes a moment to tell it from a slow vehicle.
    assert sum(abs(travel.distance) for travel in travels) < 0.1 * CELL
    stood = travels[3:]
    assert {(travel.distance, travel.state) for travel in stood} == {(0.0, TravelState.STANDING)}
    # A measurement is never certain, but a minute adds less than a cell of uncertainty.
    assert min(travel.variance for travel in stood) > 0.0
    assert 600 * max(travel.variance for travel in stood) < CELL ** 2


@pytest.mark.parametrize('rate', [10.0, 60.0, 120.0])
@pytest.mark.parametrize('speed', [0.15, 0.85, 2.0])
def test_the_way_of_a_slow_vehicle_does_not_depend_on_the_frame_rate(speed, rate):
    road, seconds = Road(PINHOLE), 1.5
    meter = RoadMeter(PINHOLE, Horizon(), pitch_known=True)
    meter.start(road.seen(0.0))
    travels = []
    for index in range(1, round(seconds * rate) + 1):
        way = speed * index / rate
        since = 1.0 / rate
        travels.append(meter.update(
            road.seen(way), since, motion(passing=0.1 * speed * since)))
    assert {travel.state for travel in travels} == {TravelState.MEASURED}
    assert sum(travel.distance for travel in travels) == pytest.approx(
        speed * seconds, abs=0.02 * speed * seconds + CELL)
    # A measurement is never certain.
    assert min(travel.variance for travel in travels) > 0.0


def test_a_vehicle_that_creeps_off_loses_nothing_of_its_way():
    road = Road(PINHOLE)
    meter = RoadMeter(PINHOLE, Horizon(), pitch_known=True)
    meter.start(road.seen(0.0))
    places = [*[0.0] * 30, *np.arange(1, 40) * 0.004]
    travels = [
        meter.update(road.seen(place), 1 / 30, motion(passing=0.0)) for place in places]
    assert sum(travel.distance for travel in travels) == pytest.approx(places[-1], abs=CELL)


def test_reverse_is_told():
    travels = drive(PINHOLE, -0.15, told=0.0, pitch_known=True)
    assert sum(travel.distance for travel in travels) == pytest.approx(-0.15 * 11, rel=0.05)


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


def test_a_road_that_is_not_seen_is_bridged_ever_less_surely():
    def blank(index, frame):
        if 6 <= index < 12:
            frame[:] = 200

    travels = drive(PINHOLE, 0.5, frames=18, spoil=blank)
    bridged = travels[6:11]
    assert {travel.state for travel in bridged} == {TravelState.BRIDGED}
    assert [travel.distance for travel in bridged] == pytest.approx([0.5] * 5, rel=0.05)
    assert np.all(np.diff([travel.variance for travel in bridged]) > 0.0)
    assert travels[-1].state is TravelState.MEASURED


def test_a_speed_is_not_bridged_for_ever():
    def blank(index, frame):
        if index >= 6:
            frame[:] = 200

    travels = drive(PINHOLE, 0.5, frames=80, spoil=blank)
    states = [travel.state for travel in travels]
    bridged = states.count(TravelState.BRIDGED)
    # Five seconds after the last measurement, a vehicle may have any speed.
    assert 25 <= bridged <= 50
    assert states[-20:] == [TravelState.UNKNOWN] * 20


def test_a_short_gap_is_bridged_and_a_long_one_is_not_made_up():
    road = Road(PINHOLE)
    meter = RoadMeter(PINHOLE, Horizon())
    meter.start(road.seen(0.0))
    for index in range(1, 5):
        meter.update(road.seen(0.5 * index), 0.1, motion())
    short = meter.update(road.seen(5.0), 0.6, None)
    assert short.distance == pytest.approx(3.0, rel=0.05)
    assert short.state is TravelState.BRIDGED
    long = meter.update(road.seen(9.0), 60.0, None)
    assert long.state is TravelState.UNKNOWN
    assert long.distance < 0.1 * 60.0 * 5.0
    assert math.sqrt(long.variance) > 300.0


@pytest.mark.parametrize('step', [0.1, 0.5])
def test_a_pair_without_a_motion_is_not_counted_twice(step):
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(), pitch_known=True)
    meter.start(road.seen(0.0))
    travels = [
        meter.update(road.seen(step * index), 0.1, None if index % 4 == 0 else motion())
        for index in range(1, 24)]
    assert sum(travel.distance for travel in travels) == pytest.approx(23 * step, rel=0.03)


def test_upside_down_is_all_the_same():
    road = Road(PINHOLE)
    one, other = RoadMeter(PINHOLE, Horizon()), RoadMeter(PINHOLE, Horizon(), rotate_180=True)
    for index in range(6):
        frame = road.seen(0.4 * index)
        turned = np.ascontiguousarray(frame[::-1, ::-1])
        if index == 0:
            one.start(frame)
            other.start(turned)
            continue
        assert other.update(turned, 0.1, motion()).distance == pytest.approx(
            one.update(frame, 0.1, motion()).distance, rel=1e-3)


def test_a_curve_of_the_road_is_forgotten_at_a_reset():
    road = Road(PINHOLE)
    fresh, used = (RoadMeter(PINHOLE, Horizon(), pitch_known=True) for _ in range(2))
    # The blocks measure a pitch that goes on, so it is attributed to the road.
    used.start(road.seen(0.0))
    for index in range(1, 20):
        used.update(road.seen(0.5 * index), 0.1, motion(pitch=0.004, passing=0.05))
    used.forget()
    for meter in (fresh, used):
        meter.start(road.seen(0.0))
    one, other = (meter.update(road.seen(0.5), 0.1, motion(passing=0.05)).distance
                  for meter in (fresh, used))
    assert one == pytest.approx(other, rel=0.01)


@pytest.mark.parametrize('pitch', [-0.004, 0.004])
def test_a_pitch_that_goes_on_for_seconds_is_that_of_the_road(pitch):
    """At first, the springs may have given way."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(), pitch_known=True)
    meter.start(road.seen(0.0))
    ways = [meter.update(road.seen(0.5 * index), 0.5, motion(pitch=pitch)).distance
            for index in range(1, 16)]
    assert abs(ways[0] - 0.5) > 0.03
    assert ways[-5:] == pytest.approx([0.5] * 5, rel=0.03)


@pytest.mark.parametrize('pitch', [-0.01, 0.01])
def test_a_picture_that_stays_while_the_camera_nods_is_fixed_to_it(pitch):
    """With the nod taken out, it slides; what slides to the other side is the road."""
    frame = Road(PINHOLE).seen(0.0)
    look = RoadLook(GroundPatch(PINHOLE, Horizon(), stretches(PINHOLE, Horizon())[0]))
    look.look(frame)
    look.keep()
    look.look(frame)
    look.compare(rotation(0.0, pitch, 0.0))
    found, other = (
        look.find(-1.0, 1.0, Turned(0.0, nodded, 0.0, 0.0, 0.1, 0.0), stretched=1.0)
        for nodded in (pitch, -pitch))
    assert found.fixed and not other.fixed
    assert abs(found.raw) > CELL and found.raw * pitch < 0.0


def test_a_part_of_the_road_that_stands_is_a_rival_of_the_rest():
    """An encoder copies it from the frame before, while everything else shows that it moves."""
    road = Road(PINHOLE)
    frames = [road.seen(0.3 * index) for index in range(20)]
    told = []
    for share in (0.0, 0.75):
        meter = RoadMeter(PINHOLE, Horizon(0.0), pitch_known=True)
        meter.start(frames[0])
        last = round(640 * share)
        travels = []
        for frame in frames[1:]:
            shown = frame.copy()
            shown[:, :last] = frames[0][:, :last]
            travels.append(meter.update(shown, 0.1, motion()))
        told.append(np.mean([travel.rivalled for travel in travels]))
    assert told[0] == 0.0 and told[1] > 0.5


def test_the_road_passes_no_slower_than_what_is_nearest_does():
    """Blocks that pass by a tenth of their distance are not next to a wheel."""
    road = Road(PINHOLE)
    meter = RoadMeter(PINHOLE, Horizon(0.0), pitch_known=True)
    meter.start(road.seen(0.0))
    travel = meter.update(road.seen(0.1), 0.1, motion(passing=0.1))
    assert travel.state is not TravelState.MEASURED


def test_a_road_that_slides_faster_than_tyres_allow_is_found_at_once():
    """As after a frozen picture: the speed before it does not hold."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(), pitch_known=True)
    meter.start(road.seen(0.0))
    for _ in range(8):
        stands = meter.update(road.seen(0.0), 0.1, motion(passing=0.0))
    assert stands.state is TravelState.STANDING
    travels = [meter.update(road.seen(0.9 * count), 0.1, motion(passing=0.06))
               for count in range(1, 9)]
    assert {travel.state for travel in travels} == {TravelState.MEASURED}
    assert sum(travel.distance for travel in travels) == pytest.approx(7.2, rel=0.02)


def test_a_picture_that_freezes_for_a_moment_does_not_stop_a_fast_vehicle():
    """The blocks of a single pair may show no motion, as may its road; tyres do not brake so."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(), pitch_known=True)
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


def test_what_shows_beside_a_copy_is_not_the_road():
    """Most is copied from the frame before, and the rest has moved by less than lobes reach."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(), pitch_known=True)
    meter.start(road.seen(0.0))
    for place in 7.0 * np.arange(1, 8):
        new, copied = road.seen(place), road.seen(place)
        copied[:, 270:370] = road.seen(place + 0.15)[:, 270:370]
        for frame in (new, copied):
            travel = meter.update(frame, 0.04, motion())
            assert travel.state is not TravelState.MEASURED


def test_reverse_is_told_beside_a_copy():
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(), pitch_known=True)
    meter.start(road.seen(20.0))
    copied = road.seen(20.0)
    copied[:, 250:390] = road.seen(19.64)[:, 250:390]
    travel = meter.update(copied, 0.2, None, yaw=0.0)
    assert travel.state is TravelState.MEASURED
    assert travel.distance == pytest.approx(-0.36, abs=CELL)


@pytest.mark.parametrize('rate', [30.0, 120.0])
def test_a_slow_vehicle_that_speeds_up_is_followed(rate):
    """What is near shows that it moves before the road has slid by a cell."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(), pitch_known=True)
    times = np.arange(0.0, 2.0, 1.0 / rate)
    ways = 0.3 * times + 0.15 * times ** 2
    meter.start(road.seen(0.0))
    travels = [
        meter.update(road.seen(way), 1.0 / rate, motion(passing=0.4 * (way - before)))
        for before, way in pairwise(ways)]
    assert sum(travel.distance for travel in travels if travel.known) == pytest.approx(
        ways[-1], rel=0.02, abs=CELL)
    assert meter.speed_filter.speed == pytest.approx(0.3 + 0.3 * times[-1], rel=0.1)


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
        assert meter.tilt.deviation < math.radians(0.5)
        errors.append((meter.tilt.pitch - pitch) / meter.tilt.deviation)
    assert 0.2 < np.sqrt(np.mean(np.square(errors))) < 1.5


def test_a_reflection_far_stronger_than_the_road_is_learned_and_taken_out():
    """The horizon hardly moves, as on a motorway; that the road slides tells that it drives."""
    missed = 0
    for seed in (2, 3, 4):
        road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(), pitch_known=True)
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
    road, meter, ways = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(), pitch_known=True), []
    for index in range(6):
        frame = road.seen(0.5 * index)
        frame[195:] = NOISE[:45, :640]
        if index == 0:
            meter.start(frame)
        else:
            ways.append(meter.update(frame, 0.1, motion(passing=0.006)).distance)
    assert ways == pytest.approx([0.5] * 5, abs=CELL)


def test_an_error_of_the_pitch_counts_by_twice_the_distance_of_the_road():
    near, far = stretches(PINHOLE, Horizon())
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon())
    meter.start(road.seen(0.0))
    travel = meter.update(road.seen(0.5), 0.1, motion())
    for share, deviation in ((travel.swing, meter.tilt.swing_deviation),
                             (travel.tilt, meter.tilt.common_deviation)):
        assert near.begin < share / deviation / 2.0 < far.end
    # The rest is that of the peak.
    assert 0.0 < math.sqrt(travel.own_variance) < CELL


def test_two_patches_that_disagree_are_not_averaged():
    """As with something else on the far road: the better one counts alone."""
    for split in (190, 200):
        road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(), pitch_known=True)
        for index in range(12):
            frame = road.seen(0.5 * index)
            frame[:split] = road.seen(40.0 + 0.25 * index)[:split]
            if index == 0:
                meter.start(frame)
                continue
            distance = meter.update(frame, 0.1, motion()).distance
            assert min(abs(distance - 0.5), abs(distance - 0.25)) < CELL


def test_a_road_that_no_pair_shows_surely_is_measured_by_half_a_second():
    """An encoder copies it from the frame before, but for a strip with much noise."""
    road, rng = Road(PINHOLE), np.random.default_rng(0)
    meter = RoadMeter(PINHOLE, Horizon(), pitch_known=True)
    shown, travels = road.seen(0.0), []
    meter.start(shown)
    for index in range(1, 60):
        shown = shown.copy()
        shown[:, 308:332] = road.seen(0.5 * index)[:, 308:332]
        noisy = shown + 12.0 * rng.normal(size=shown.shape)
        travels.append(meter.update(np.clip(noisy, 0, 255).astype(np.uint8), 0.04, motion()))
    late = travels[12:]
    measured = [travel for travel in late if travel.state is TravelState.MEASURED]
    assert len(measured) > 0.9 * len(late)
    assert sum(travel.distance for travel in late) == pytest.approx(0.5 * len(late), rel=0.05)
    # The mean of many pairs is surer than each, but their errors are no larger than told.
    told = math.sqrt(np.mean([travel.variance for travel in measured]))
    assert 0.3 * told < np.std([travel.distance for travel in measured]) < 1.3 * told
    # After a reset, it takes as long again.
    meter.forget()
    meter.start(shown)
    noisy = road.seen(0.5 * 60) + 60.0 * rng.normal(size=shown.shape)
    travel = meter.update(np.clip(noisy, 0, 255).astype(np.uint8), 0.04, motion())
    assert travel.state is TravelState.UNKNOWN


def test_a_patch_is_the_same_in_any_light():
    """Half as bright, with half the contrast, or with a shadow over a part of it."""
    road = Road(PINHOLE).seen(0.0)
    patch = GroundPatch(PINHOLE, Horizon(), stretches(PINHOLE, Horizon())[0])
    bright = patch(road)
    inner = patch.window > 0.3
    for light in (0.5, 2.0, np.linspace(0.6, 1.6, road.shape[1])):
        seen = patch(np.clip(np.float32(40.0) + 0.7 * light * (road - 60.0), 0, 255))
        assert np.std((seen - bright)[inner]) < 0.15 * np.std(bright[inner])
