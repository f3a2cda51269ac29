# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A road as a plane of noise, seen by cameras that move over it."""

from dataclasses import replace
from itertools import pairwise
import math

import cv2
import numpy as np
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.road.ground import CELL, GroundPatch, rotation, stretches
from phase_traj_ros.core.road.meter import RoadMeter
from phase_traj_ros.core.road.patch_correlator import PatchCorrelator
from phase_traj_ros.core.road.travel import TravelState
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion
import pytest
from road_scene import drive, FISHEYE, LEVEL, motion, PINHOLE, Road, SURE


@pytest.mark.parametrize('camera', [PINHOLE, FISHEYE])
@pytest.mark.parametrize('step', [0.1, 0.5, 1.3])
def test_the_way_is_that_of_the_road(camera, step):
    travels = drive(camera, step, pitch=0.03)
    assert {travel.state for travel in travels} == {TravelState.MEASURED}
    assert np.mean([travel.distance for travel in travels]) == pytest.approx(
        step, rel=0.02, abs=0.1 * CELL)
    for travel in travels:
        assert abs(travel.distance - step) < 3.0 * math.sqrt(travel.variance)


def test_a_sure_and_wrong_prior_is_believed_but_for_what_the_springs_may_do():
    right, little, much = (
        np.mean([travel.distance for travel in drive(
            PINHOLE, 0.5, pitch=0.02, told=told, frames=8)])
        for told in (0.02, 0.03, 0.08))
    assert right == pytest.approx(0.5, rel=0.015)
    assert little == pytest.approx(0.5, rel=0.03)
    assert much < 0.95 * 0.5


@pytest.mark.parametrize(('yaw', 'pitch', 'roll'), [
    (0.06, 0.0, 0.0), (-0.06, 0.0, 0.0), (0.0, 0.008, 0.0), (0.0, 0.0, 0.03)])
def test_rotation_is_taken_out(yaw, pitch, roll):
    road = Road(PINHOLE)
    patch = GroundPatch(PINHOLE, LEVEL, stretches(PINHOLE, LEVEL)[0])
    slide = PatchCorrelator(patch.window)
    slide.set_reference(patch(road.seen(0.0)))
    # Seen from a camera that has turned up by the pitch (nose down is positive).
    turned = patch(road.seen(0.6, yaw=yaw, pitch=-pitch, roll=roll))
    slide.compare(patch.derotated(turned, rotation(yaw, pitch, roll)))
    with_it = slide.peak(0, slide.max_cells)
    slide.compare(turned)
    assert with_it.cells * CELL == pytest.approx(0.6, rel=0.02)
    assert with_it.score > 12.0


@pytest.mark.parametrize('yaw_rate', [0.4, -0.4])
@pytest.mark.parametrize('roll', [0.0, 0.3])
def test_the_turn_of_a_rolled_camera_whose_blocks_do_not_agree(roll, yaw_rate):
    road, pitch, step, distances = Road(PINHOLE, 0.03), 0.03, 0.4, []
    meter = RoadMeter(PINHOLE, Horizon(pitch, pitch_deviation=0.01))
    x = y = yaw = 0.0
    for index in range(40):
        frame = road.seen(x, y, yaw=yaw, roll=roll)
        seen = 0.1 * yaw_rate * math.cos(roll) * math.cos(pitch)
        if index == 0:
            meter.start(frame, roll)
        elif index < 6:
            blocks = motion(seen, -seen * math.tan(roll), slope=-math.tan(pitch))
            meter.update(frame, 0.1, blocks, roll=roll)
        else:
            distances.append(meter.update(frame, 0.1, None, yaw=seen, roll=roll).distance)
        middle = yaw + 0.05 * yaw_rate
        x, y, yaw = x + step * math.cos(middle), y + step * math.sin(middle), yaw + 0.1 * yaw_rate
    # Without the part of the turn that is a pitch, 12 % with 6 degrees, and 30 to 60 % with 18.
    assert np.mean(distances) == pytest.approx(step, rel=0.025)


@pytest.mark.parametrize('agree', [True, False])
def test_far_frames_tell_a_first_speed_only_where_their_blocks_agree(agree):
    """Else the frames have little in common, and the next marking may look like this one."""
    camera = CameraModel.pinhole((160, 320), 138.0)
    road, meter = Road(camera), RoadMeter(camera, SURE)
    meter.start(road.seen(0.0))
    blocks, yaw = (motion(passing=0.2), None) if agree else (None, 0.0)
    states = [
        meter.update(road.seen(2.2 * index), 0.22, blocks, yaw=yaw).state
        for index in range(1, 20)]
    assert set(states[10:]) == {TravelState.MEASURED if agree else TravelState.UNKNOWN}


def test_it_stands_before_the_pitch_is_known():
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon())
    meter.start(road.seen(0.0))
    doubt = FocusOfExpansion(slope_variance=Horizon().pitch_deviation ** 2)
    for index in range(30):
        travel = meter.update(
            road.seen(0.0), 0.1, replace(motion(passing=0.0), travel=doubt))
        assert travel.known and abs(travel.distance) < CELL
        assert index < 4 or travel.state is TravelState.STANDING
    # It has told nothing of the pitch, without which a road that moves is not measured.
    assert meter.pitch.deviation == pytest.approx(Horizon().pitch_deviation, rel=0.05)
    driving = meter.update(road.seen(1.0), 0.1, replace(motion(passing=0.05), travel=doubt))
    assert driving.state is not TravelState.MEASURED


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


@pytest.mark.parametrize(
    ('speed', 'rate'), [(0.15, 10.0), (0.15, 120.0), (2.0, 10.0), (2.0, 120.0)])
def test_the_way_of_a_slow_vehicle_does_not_depend_on_the_frame_rate(speed, rate):
    road, seconds = Road(PINHOLE), 1.5
    meter = RoadMeter(PINHOLE, SURE)
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


@pytest.mark.parametrize('rate', [10.0, 30.0])
def test_a_picture_that_seems_still_does_not_stop_a_road_that_slides(rate):
    road, meter, speed, seconds = Road(PINHOLE), RoadMeter(PINHOLE, SURE), 0.25, 3.0
    meter.start(road.seen(0.0))
    places = [speed * number / rate for number in range(1, round(seconds * rate) + 1)]
    # It takes half a second to seem still.
    travels = [
        meter.update(road.seen(place), 1.0 / rate, motion(passing=0.002 / rate),
                     still=place > 0.5 * speed) for place in places]
    assert sum(travel.distance for travel in travels) == pytest.approx(places[-1], abs=2 * CELL)


def test_a_vehicle_that_creeps_off_loses_nothing_of_its_way():
    road = Road(PINHOLE)
    meter = RoadMeter(PINHOLE, SURE)
    meter.start(road.seen(0.0))
    places = [*[0.0] * 30, *np.arange(1, 40) * 0.004]
    travels = [
        meter.update(road.seen(place), 1 / 30, motion(passing=0.0)) for place in places]
    assert sum(travel.distance for travel in travels) == pytest.approx(places[-1], abs=CELL)


@pytest.mark.parametrize('step', [-0.15, -0.8])
@pytest.mark.parametrize('told', [0.0, None])
def test_reverse_is_as_exact_as_forward(step, told):
    travels = drive(PINHOLE, step, told=told, frames=16)
    assert {travel.state for travel in travels[1:]} == {TravelState.MEASURED}
    assert sum(travel.distance for travel in travels) == pytest.approx(step * 15, rel=0.02)


def test_overtaking_traffic_does_not_turn_a_road_that_slides_ahead():
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, SURE)
    meter.start(road.seen(0.0))
    # First the vehicle passes the scene, then the traffic beside it the vehicle.
    travels = [
        meter.update(
            road.seen(0.3 * number), 0.1, motion(passing=0.03 if number < 8 else -0.03))
        for number in range(1, 40)]
    assert {travel.state for travel in travels[2:]} == {TravelState.MEASURED}
    assert sum(travel.distance for travel in travels) == pytest.approx(0.3 * 39, rel=0.02)


@pytest.mark.parametrize('passing', [0.03, -0.03])
def test_slides_tell_the_pitch_only_in_the_direction_of_the_blocks(passing):
    """Else it is the rear of a leader that pulls away."""
    road = Road(PINHOLE, 0.02)
    meter = RoadMeter(PINHOLE, Horizon(pitch_deviation=0.01))
    meter.start(road.seen(0.0))
    for number in range(1, 20):
        # The slope of the direction of travel is that of a level camera, and uncertain.
        blocks = replace(motion(passing=passing), travel=FocusOfExpansion(slope_variance=1.0))
        meter.update(road.seen(-0.3 * number), 0.1, blocks)
    assert (meter.pitch.mounting > 0.008) == (passing < 0.0)


def test_what_slides_ahead_is_no_road_in_reverse():
    """A reflection slides towards the vehicle, and is stronger than the road."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, SURE)
    meter.start(road.seen(0.0))
    travels = [
        meter.update(
            cv2.addWeighted(road.seen(-0.3 * number), 0.45, road.seen(0.4 * number + 40), 0.55, 0),
            0.1, motion(passing=-0.03))
        for number in range(1, 15)]
    assert sum(travel.distance for travel in travels[2:]) == pytest.approx(-0.3 * 12, rel=0.05)


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
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, SURE)
    meter.start(road.seen(0.0))
    travels = [
        meter.update(road.seen(step * index), 0.1, None if index % 4 == 0 else motion())
        for index in range(1, 24)]
    assert sum(travel.distance for travel in travels) == pytest.approx(23 * step, rel=0.03)


def test_a_curve_of_the_road_is_forgotten_at_a_reset():
    road = Road(PINHOLE)
    fresh, used = (RoadMeter(PINHOLE, SURE) for _ in range(2))
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


@pytest.mark.parametrize('rate_hz', [10, 30])
@pytest.mark.parametrize('nod', [-0.02, 0.02])
def test_the_springs_before_a_stop_are_no_curve_of_the_road_after_it(nod, rate_hz):
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, SURE)
    meter.start(road.seen(0.0))
    interval, pairs, way = 1 / rate_hz, rate_hz // 3, 0.0
    for index in range(pairs):
        way, pitch = way + 6.0 * interval, nod * (index + 1) / pairs
        meter.update(road.seen(way, pitch=pitch), interval,
                     motion(pitch=-nod / pairs, slope=-math.tan(pitch)))
    rests = road.seen(way)
    for _ in range(10 * rate_hz):
        meter.update(rests, interval, motion(passing=0.0), still=True)
    begun, measured = way, 0.0
    for index in range(rate_hz):
        step = 1.5 * (index + 1) * interval ** 2
        way += step
        measured += meter.update(road.seen(way), interval, motion(passing=0.1 * step)).distance
    # It was up to 27 % off.
    assert measured == pytest.approx(way - begun, rel=0.05)


@pytest.mark.parametrize('rate_hz', [10, 60])
def test_a_camera_that_shakes_measures_the_whole_way(rate_hz):
    rng, interval, shown = np.random.default_rng(4), 1 / rate_hz, 0.0
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon())
    meter.start(road.seen(0.0))
    measured = 0.0
    for index in range(1, 4 * rate_hz):
        pitch = rng.normal(0.0, math.radians(0.6))
        # The direction of travel is that in the newest frame.
        measured += meter.update(road.seen(3.0 * interval * index, pitch=pitch), interval, motion(
            pitch=shown - pitch, slope=-math.tan(pitch), passing=0.3 * interval)).distance
        shown = pitch
    # Without the changes of the pitch, it was 5 % too far.
    assert measured == pytest.approx(3.0 * interval * index, rel=0.015)


@pytest.mark.parametrize('pitch', [-0.004, 0.004])
def test_a_pitch_that_goes_on_for_seconds_is_that_of_the_road(pitch):
    """At first, the springs may have given way."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, SURE)
    meter.start(road.seen(0.0))
    ways = [meter.update(road.seen(0.5 * index), 0.5, motion(pitch=pitch)).distance
            for index in range(1, 16)]
    assert abs(ways[0] - 0.5) > 0.03
    assert ways[-5:] == pytest.approx([0.5] * 5, rel=0.03)


def test_the_road_passes_no_slower_than_what_is_nearest_does():
    """Blocks that pass by a tenth of their distance are not next to a wheel."""
    road = Road(PINHOLE)
    meter = RoadMeter(PINHOLE, SURE)
    meter.start(road.seen(0.0))
    travel = meter.update(road.seen(0.1), 0.1, motion(passing=0.1))
    assert travel.state is not TravelState.MEASURED


def test_a_road_that_slides_faster_than_tyres_allow_is_found_at_once():
    """As after a frozen picture: the speed before it does not hold."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, SURE)
    meter.start(road.seen(0.0))
    for _ in range(8):
        stands = meter.update(road.seen(0.0), 0.1, motion(passing=0.0))
    assert stands.state is TravelState.STANDING
    travels = [meter.update(road.seen(0.9 * count), 0.1, motion(passing=0.06))
               for count in range(1, 9)]
    assert {travel.state for travel in travels} == {TravelState.MEASURED}
    assert sum(travel.distance for travel in travels) == pytest.approx(7.2, rel=0.02)


@pytest.mark.parametrize('rate', [30.0, 120.0])
def test_a_slow_vehicle_that_speeds_up_is_followed(rate):
    """What is near shows that it moves before the road has slid by a cell."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, SURE)
    times = np.arange(0.0, 2.0, 1.0 / rate)
    ways = 0.3 * times + 0.15 * times ** 2
    meter.start(road.seen(0.0))
    travels = [
        meter.update(road.seen(way), 1.0 / rate, motion(passing=0.4 * (way - before)))
        for before, way in pairwise(ways)]
    assert sum(travel.distance for travel in travels if travel.known) == pytest.approx(
        ways[-1], rel=0.02, abs=CELL)
    assert meter.speed_filter.speed == pytest.approx(0.3 + 0.3 * times[-1], rel=0.15)


def test_a_road_that_no_pair_shows_surely_is_measured_by_half_a_second():
    """An encoder copies it from the frame before, but for a strip with much noise."""
    road, rng = Road(PINHOLE), np.random.default_rng(0)
    meter = RoadMeter(PINHOLE, SURE)
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
