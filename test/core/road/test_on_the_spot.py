# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot that turns on the spot has its heading, and travels no distance."""

import math

import cv2
import numpy as np
from phase_traj_ros.core import CodeSource, EstimatorSettings, Lens, TrajectoryEstimator
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.road.meter import RoadMeter
from phase_traj_ros.core.road.travel import TravelState
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
from phase_traj_ros.synthetic.degradations import sensor_noise
import pytest
from road_scene import motion, PINHOLE, Road

CAMERA = Camera.with_field_of_view(320, 240, 70.0)


@pytest.mark.parametrize(('rate_hz', 'degrees', 'seconds', 'waits'), [
    (15.0, 360.0, 5.0, 0), (30.0, -180.0, 2.5, 1), (10.0, 90.0, 4.5, 1)])
def test_a_turn_on_the_spot_is_one_of_the_heading_alone(rate_hz, degrees, seconds, waits):
    drive = plan_drive(
        'spot',
        [Straight(1.5), *[Straight(1, 0)] * waits, Turn(degrees, seconds, 0), Straight(1.5)],
        rate_hz=rate_hz, speed=1.0, camera=CAMERA, seed=5)
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, lens=Lens(focal_px=drive.camera.focal),
        camera_height=drive.camera.above_ground))
    updates = [
        estimator.update(sensor_noise(frame, sigma=1.5, seed=seed), stamp_ns)
        for seed, (frame, stamp_ns) in enumerate(
            zip(render_drive(drive), drive.stamps_ns.tolist()))]
    headings = np.degrees([update.heading.heading for update in updates[1:]])
    true = np.degrees(drive.poses[1:, 2] - drive.poses[0, 2])
    assert np.abs(headings - true).max() < 0.7
    way = np.hypot(*np.diff(drive.poses[:, :2], axis=0).T).sum()
    assert sum(update.travel.distance for update in updates[1:]) == pytest.approx(way, abs=0.25)
    assert estimator.reliability.of_drive.reliable


@pytest.mark.parametrize('waits', [0, 6])
@pytest.mark.parametrize(('step', 'measured'), [
    (0.09, True), (0.09, False), (-0.03, True), (-0.03, False), (0.01, True)])
def test_the_road_below_a_turn_on_the_spot_stays_in_place(step, measured, waits):
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(pitch_deviation=0.005))
    meter.start(road.seen(0.0))
    for place in np.cumsum([*[0.3] * 8, 0.2, 0.1, 0.05]):
        meter.update(road.seen(place), 0.1, motion(passing=0.03))
    for _ in range(waits):
        meter.update(road.seen(place), 0.1, motion(passing=0.0))
    travels = [
        meter.update(
            road.seen(place, yaw=step * number), 0.1,
            motion(yaw=step, passing=0.003) if measured else None, yaw=step)
        for number in range(1, 40)]
    turned = travels[10:]
    assert TravelState.UNKNOWN not in {travel.state for travel in turned}
    assert abs(sum(travel.distance for travel in turned)) < 0.05


@pytest.mark.parametrize('step', [0.09, 0.02])
def test_a_bonnet_in_a_corner_is_not_a_road_that_stays_in_place(step):
    bonnet = np.random.default_rng(3).normal(100.0, 40.0, PINHOLE.shape)

    def seen(number):
        yaw, radius = step * number, 0.3 / step
        frame = road.seen(radius * math.sin(yaw), radius * (1.0 - math.cos(yaw)), yaw)
        frame[200:] = np.clip(bonnet[200:], 0, 255)
        return frame

    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(pitch_deviation=0.005))
    meter.start(seen(0))
    travels = [
        meter.update(seen(number), 0.1, motion(yaw=step, passing=0.03)) for number in range(1, 40)]
    assert sum(travel.distance for travel in travels[5:]) == pytest.approx(34 * 0.3, rel=0.05)


def test_the_copies_of_an_encoder_that_turn_with_the_scene_do_not_stop_a_car():
    def seen(number):
        yaw = 0.06 * number
        slides = road.seen(5.0 * math.sin(yaw), 5.0 * (1.0 - math.cos(yaw)), yaw)
        return cv2.addWeighted(slides, 0.4, road.seen(0.0, yaw=yaw), 0.6, 0.0)

    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(pitch_deviation=0.005))
    meter.start(seen(0))
    travels = [
        meter.update(seen(number), 0.1, motion(yaw=0.06, passing=0.03)) for number in range(1, 40)]
    assert sum(travel.distance for travel in travels[5:]) == pytest.approx(34 * 0.3, rel=0.05)


def test_a_single_pair_does_not_stop_a_vehicle_that_turns():
    road, meter = Road(PINHOLE), RoadMeter(PINHOLE, Horizon(pitch_deviation=0.005))
    meter.start(road.seen(0.0))
    for place in 0.8 * np.arange(1, 12):
        meter.update(road.seen(place), 0.1, motion(passing=0.08))
    travel = meter.update(road.seen(place, yaw=0.09), 0.1, motion(yaw=0.09, passing=0.003))
    assert travel.state is TravelState.BRIDGED and travel.distance == pytest.approx(0.8, abs=0.05)
