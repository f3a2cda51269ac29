# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A road that rests shows that the vehicle stands, whatever the blocks follow."""

from dataclasses import replace
import math

import cv2
import numpy as np
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.road.ground import CELL
from phase_traj_ros.core.road.meter import RoadMeter
from phase_traj_ros.core.road.travel import TravelState
import pytest
from road_scene import motion, PINHOLE, Road

BRAKING = np.cumsum([*[0.4] * 12, 0.3, 0.2, 0.1, 0.05])
STOP = [BRAKING[-1]] * 10
STARTING = BRAKING[-1] + np.cumsum([0.05, 0.1, 0.2, *[0.3] * 12])


def travels_of(pairs, *, cover=None, before=None, roll=0.0):
    """
    Return the travel of each pair of place and motion, and draw ``cover`` over the road.

    ``before`` is called with the number of a pair and the meter before the pair is measured.
    """
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(pitch_deviation=0.005))
    rng, travels = np.random.default_rng(3), []
    meter.start(road.seen(0.0, roll=roll), roll)
    for number, (place, moved) in enumerate(pairs):
        frame = road.seen(place, roll=roll) + rng.normal(0.0, 1.0, PINHOLE.shape)
        if cover is not None:
            cover(number, frame)
        if before is not None:
            before(number, meter)
        travels.append(meter.update(
            np.clip(frame, 0, 255).astype(np.uint8), 0.1, moved, roll=roll))
    return travels


def driven(places):
    """Return the pairs of a drive whose blocks show the true motion."""
    steps = np.diff([0.0, *places])
    return [(place, motion(passing=0.1 * step)) for place, step in zip(places, steps)]


@pytest.mark.parametrize(('roll', 'moved'), [
    (0.0, replace(motion(passing=0.05), agreement=0.4)), (0.1, motion(yaw=0.05, passing=0.0)),
    (0.0, motion(yaw=-0.02, pitch=0.01, passing=0.005)), (0.0, motion(passing=-0.05))])
def test_a_vehicle_stands_while_its_blocks_follow_traffic(roll, moved):
    before = driven([*BRAKING, *STOP])
    traffic = [(BRAKING[-1], moved)] * 40

    def cover(number, frame):
        if len(before) <= number < len(before) + len(traffic):
            # A lorry covers what is farther than seven heights.
            stripes = np.sin(0.3 * np.arange(640) - 2.0 * number)
            frame[:172] = 128 + 90 * stripes

    travels = travels_of([*before, *traffic, *driven(STARTING)[1:]], cover=cover, roll=roll)
    stood = travels[len(before):len(before) + len(traffic)]
    assert all(travel.rests and travel.distance == 0.0 for travel in stood)
    assert {travel.state for travel in stood} == {TravelState.STANDING}
    moves = travels[len(before) + len(traffic) + 3:]
    assert not any(travel.rests for travel in moves)
    assert sum(travel.distance for travel in moves) == pytest.approx(11 * 0.3, rel=0.05)


@pytest.mark.parametrize(('deviation', 'rows'), [(14.0, 0), (40.0, 194)])
def test_dirt_and_a_bonnet_are_not_a_road_that_rests(deviation, rows):
    """Dirt as strong as the road covers all of it, and the bonnet the near road."""
    dirt = cv2.GaussianBlur(np.random.default_rng(2).normal(size=PINHOLE.shape), (0, 0), 1.5)
    dirt *= deviation / dirt.std()

    def cover(_, frame):
        frame[rows:] = (frame[rows:] if rows == 0 else 100.0) + dirt[rows:]

    places = [*BRAKING, *STOP, *STARTING]
    travels = travels_of(driven(places), cover=cover)
    # The first pairs of a start may be bridged.
    moves = travels[len(BRAKING) + len(STOP) + 4:]
    assert not any(travel.rests for travel in moves)
    assert sum(travel.distance for travel in moves) == pytest.approx(11 * 0.3, rel=0.05)


def test_a_load_on_the_near_road_holds_the_vehicle_for_a_moment_only():
    """It is laid down at the stop; then most of the blocks agree that the scene passes by."""
    load = cv2.GaussianBlur(np.random.default_rng(2).normal(size=PINHOLE.shape), (0, 0), 1.5)

    def cover(number, frame):
        if number >= len(BRAKING) + 2:
            frame[194:] = 100.0 + 40.0 / load.std() * load[194:]

    places = [*BRAKING, *STOP, *STARTING]
    travels = travels_of(driven(places), cover=cover)
    stood, moves = np.split(np.array(travels), [len(BRAKING) + len(STOP)])
    assert stood[-1].rests
    assert not any(travel.rests for travel in moves[4:])
    assert sum(travel.distance for travel in moves[6:]) == pytest.approx(9 * 0.3, rel=0.05)


def test_a_load_does_not_hold_a_vehicle_that_reverses():
    """It is laid down while the vehicle drives."""
    load = cv2.GaussianBlur(np.random.default_rng(2).normal(size=PINHOLE.shape), (0, 0), 1.5)

    def cover(number, frame):
        if number >= 20:
            frame[194:] = 100.0 + 40.0 / load.std() * load[194:]

    travels = travels_of(driven(-0.2 * np.arange(1, 50)), cover=cover)
    assert not any(travel.rests for travel in travels[1:])
    assert sum(travel.distance for travel in travels[24:]) == pytest.approx(-0.2 * 25, rel=0.05)


def test_a_vehicle_that_stops_stands_although_traffic_moves_at_once():
    before = [*BRAKING, *STOP[:1]]
    lorry = [(BRAKING[-1], replace(motion(passing=0.1), agreement=0.4))] * 20

    def cover(number, frame):
        if number >= len(before):
            # It comes to seven heights, and its stripes approach.
            frame[:172] = 128 + 90 * np.sin(0.3 * np.arange(640) - 2.0 * number)

    travels = travels_of([*driven(before), *lorry], cover=cover)
    assert abs(sum(travel.distance for travel in travels[len(before):])) < 2 * CELL
    assert travels[-1].rests


@pytest.mark.parametrize(('agreement', 'rests'), [(0.8, True), (0.6, False)])
def test_a_road_that_an_encoder_changes_rests_if_the_blocks_do(agreement, rests):
    rng = np.random.default_rng(5)
    still = replace(motion(passing=0.0), agreement=agreement)

    before = driven([*BRAKING, *STOP])

    def cover(number, frame):
        if number >= len(before):
            frame += rng.normal(0.0, 20.0, PINHOLE.shape)

    travels = travels_of([*before, *[(BRAKING[-1], still)] * 30], cover=cover)
    stood = travels[len(before):]
    assert {travel.state for travel in stood} == {TravelState.STANDING}
    assert {travel.rests for travel in stood} == {rests}


@pytest.mark.parametrize(('places', 'hides', 'covered'), [
    (0.4 * np.arange(1, 17), True, True), (BRAKING, True, False),
    # A small robot brakes as hard, and still sees the same scene.
    (0.4 * np.arange(1, 17), False, False)])
def test_what_covers_the_view_of_a_vehicle_does_not_stop_it(places, hides, covered):
    """No vehicle stops between two frames, and then the view is another one."""
    dirt = cv2.GaussianBlur(np.random.default_rng(2).normal(size=PINHOLE.shape), (0, 0), 1.5)

    def cover(number, frame):
        if hides and len(places) <= number < len(places) + 60:
            frame[:] = 100.0 + 40.0 / dirt.std() * dirt

    change = [(places[-1], replace(motion(passing=0.0), agreement=0.4))] * 2
    later = driven([*places, *places[-1] + 0.4 * np.arange(1, 20)])[len(places):]
    travels = travels_of([
        *driven(places), *change, *[(places[-1], motion(passing=0.0))] * 58, *later], cover=cover)
    hidden = travels[len(places) + 4:len(places) + 60]
    states = {travel.state for travel in hidden}
    assert any(travel.covered for travel in hidden) is covered
    assert states == (
        {TravelState.BRIDGED, TravelState.UNKNOWN} if covered else {TravelState.STANDING})
    assert any(travel.rests for travel in hidden) is not covered
    # The road is seen again.
    assert travels[-1].state is TravelState.MEASURED
    assert not travels[-1].covered
    assert travels[-1].distance == pytest.approx(0.4, rel=0.1)


def test_a_robot_that_sees_only_the_floor_stops_hard():
    """Whatever it sees is soon out of view, which shows no cover."""
    meter, road = RoadMeter(PINHOLE, Horizon(0.6, pitch_deviation=0.005)), Road(PINHOLE, 0.6)
    places = [*0.4 * np.arange(20), *[19 * 0.4] * 20]
    meter.start(road.seen(0.0))
    travels = [
        meter.update(road.seen(place), 0.1, motion(slope=-math.tan(0.6), passing=0.1 * step))
        for place, step in zip(places[1:], np.diff(places))]
    assert not any(travel.covered for travel in travels)
    assert travels[-1].state is TravelState.STANDING


@pytest.mark.parametrize(('passing', 'agreement', 'stands'), [
    (0.0, 0.9, True), (0.003, 0.9, False), (0.1, 0.4, True)])
def test_the_copied_road_of_a_slow_vehicle_does_not_stop_it(passing, agreement, stands):
    """Blocks that creep are those of the scene; close traffic moves by more."""
    slow = [*BRAKING, *BRAKING[-1] + 0.05 * np.arange(1, 11)]
    blocks = replace(motion(passing=passing), agreement=agreement)
    travels = travels_of([*driven(slow), *[(slow[-1], blocks)] * 20])
    assert any(travel.rests for travel in travels[len(slow):]) is stands


@pytest.mark.parametrize(('texture', 'state'), [
    (True, TravelState.STANDING), (False, TravelState.BRIDGED)])
def test_a_still_picture_stops_a_fast_vehicle_only_if_the_road_rests(texture, state):
    """A road without texture looks the same wherever it is."""
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(pitch_deviation=0.005))
    rng, travels = np.random.default_rng(3), []
    places = [*np.arange(12.0), *[11.0] * 24]
    for number, place in enumerate(places):
        frame = road.seen(place) + rng.normal(0.0, 1.0, PINHOLE.shape)
        if number >= 12 and not texture:
            frame[120:] = 110 + rng.normal(0.0, 1.0, frame[120:].shape)
        picture = np.clip(frame, 0, 255).astype(np.uint8)
        if number == 0:
            meter.start(picture)
        else:
            still = number >= 12
            moved = motion(passing=0.0 if still else 0.1)
            travels.append(meter.update(picture, 0.1, moved, still=still))
    assert {travel.state for travel in travels[11:14]} == {state}
    # It has had the time to brake.
    assert travels[-1].state is TravelState.STANDING


@pytest.mark.parametrize(('pairs', 'learns'), [(20, True), (5, False)])
@pytest.mark.parametrize('remake', [
    lambda meter: meter.use_mask(np.ones(PINHOLE.shape, np.float32)),
    # As if they had been made for another pitch.
    lambda meter: setattr(meter._view, 'pitch', 0.01)])
def test_after_a_longer_drive_new_patches_rest_as_those_before_them(remake, pairs, learns):
    """Of a few keyframes, the mean would hold the road itself, and a start would be too short."""
    braking = np.cumsum([*[0.4] * pairs, 0.3, 0.2, 0.1, 0.05])
    traffic = [(braking[-1], replace(motion(yaw=0.02, passing=0.0), agreement=0.4))] * 10
    stop = driven([*braking, *[braking[-1]] * 10])
    start = driven([*braking, *(braking[-1] - BRAKING[-1] + STARTING)])[len(braking):]
    seen = []

    def before(number, meter):
        if number == len(braking) - 4:
            seen.extend(meter._view.patches)
            remake(meter)
        if number == len(braking) - 3:
            assert not set(seen) & set(meter._view.patches)
            assert meter._view.patches[0].has_moved == learns

    travels = travels_of([*stop, *traffic, *start], before=before)
    stood, start = travels[len(stop):-len(start)], travels[-len(start):]
    assert all(travel.rests for travel in stood) or not learns
    assert sum(travel.distance for travel in start) == pytest.approx(3.95, abs=2 * CELL)


def test_nothing_rests_before_the_road_has_moved():
    # It may be the body of the vehicle.
    travels = travels_of([(0.0, motion(yaw=0.02, passing=0.05))] * 20)
    assert not any(travel.rests for travel in travels)


def test_a_leader_that_drives_off_at_the_start_of_a_film_is_not_reverse():
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(pitch_deviation=0.005))
    meter.start(road.seen(0.0))
    travels = []
    for number in range(1, 30):
        frame = road.seen(0.0)
        # Farther than seven heights.
        frame[:172] = road.seen(-0.2 * max(number - 10, 0))[:172]
        recedes = -0.04 if number > 12 else 0.0
        travels.append(meter.update(frame, 0.1, motion(passing=recedes)))
    assert travels[-1].state is TravelState.STANDING
    assert abs(sum(travel.distance for travel in travels)) < 0.3


def test_a_start_loses_no_more_than_two_cells():
    places = [*BRAKING, *STOP, *BRAKING[-1] + 0.02 * np.arange(1, 60)]
    travels = travels_of(driven(places))
    start = travels[len(BRAKING) + len(STOP):]
    assert sum(travel.distance for travel in start) == pytest.approx(1.18, abs=2 * CELL)
