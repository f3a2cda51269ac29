# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Distances that are unknown or wrong are said to be."""

from functools import cache

from phase_traj_ros.core import CodeSource, EstimatorSettings, Lens, TrajectoryEstimator
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.road.travel import TravelState
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
from phase_traj_ros.synthetic.degradations import sensor_noise
import pytest

TENTH = 100_000_000
CORNER = (Straight(3.0), Turn(-90.0, 3.0, 4.5), Straight(2.0))


@cache
def filmed(hfov_deg, *plan):
    return list(render_drive(plan_drive(
        'a drive', plan, rate_hz=10.0, speed=6.0, seed=8,
        camera=Camera.with_field_of_view(320, 240, hfov_deg))))


def corner():
    """Return the pictures of a right turn, which lasts from 3 to 6 s."""
    return filmed(100.0, *CORNER)


def straight():
    """Return those before the turn."""
    return corner()[:31]


def followed(frames, *, period_ns=TENTH, **settings):
    estimator = TrajectoryEstimator(EstimatorSettings(code_source=CodeSource.AUTO, **settings))
    for n, frame in enumerate(frames):
        estimator.update(frame, n * period_ns)
    return estimator


def test_metres_before_the_turn_that_determines_the_camera_are_in_doubt():
    estimator = followed(corner(), camera_height=1.65)
    assert estimator.reliability.of_drive.words == ('camera_not_known',)
    [span] = estimator.reliability.spans
    assert span.start_ns == 0 and 35 * TENTH < span.end_ns < 65 * TENTH
    assert followed(corner()).reliability.of_drive.reliable
    # A lens that is given later does not make them right.
    estimator = followed(straight(), camera_height=1.65)
    estimator.use_lens(Lens(hfov_deg=100.0))
    assert estimator.reliability.words == ('camera_not_known',)


def test_metres_need_the_camera_also_on_a_straight():
    frames = straight()
    assert followed(frames).reliability.reliable
    assert followed(frames, camera_height=1.65).reliability.words == ('camera_not_known',)
    known = followed(frames, camera_height=1.65, lens=Lens(hfov_deg=100.0))
    assert known.reliability.reliable
    # A vehicle that stands has no metres.
    stands = [sensor_noise(frames[0], sigma=1.0, seed=n) for n in range(60)]
    assert followed(stands, camera_height=1.65).reliability.reliable


def test_standing_does_not_hide_metres_in_doubt():
    estimator = followed(corner(), camera_height=1.65)
    # For more than the minute that the verdict is on.
    for n in range(260):
        stands = sensor_noise(corner()[-1], sigma=1.0, seed=n)
        estimator.update(stands, 80 * TENTH + (n + 1) * TENTH * 5 // 2)
    assert estimator.reliability.reliable
    assert estimator.reliability.of_drive.words[0] == 'camera_not_known'


@pytest.mark.parametrize('height', [0.0, 1.65])
def test_metres_after_given_speeds_are_those_of_the_camera_that_a_turn_determines(height):
    # At 6 m/s before the turn, whose last speed is given 2 s before it, and after it.
    frames = filmed(100.0, Straight(5.0), Turn(-90.0, 3.0, 4.5), Straight(4.0))
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, awaits_speeds=True, camera_height=height))
    updates = []
    for n, frame in enumerate(frames):
        if n <= 30:
            estimator.add_speed(n * TENTH, 6.0)
        updates.append(estimator.update(frame, n * TENTH))
    after = [update.travel for update in updates[-20:]]
    assert all(travel.state is TravelState.MEASURED for travel in after)
    assert sum(travel.distance for travel in after) == pytest.approx(12.0, rel=0.07)
    assert after[0].scale < 0.1


def test_a_camera_is_learned_after_the_clock_starts_again():
    # For longer than the drive after it.
    estimator = followed(straight(), period_ns=3 * TENTH)
    estimator.reset()
    for n, frame in enumerate(corner()):
        estimator.update(frame, n * TENTH)
    assert estimator.heading.camera.in_use.settled


def test_a_zoom_lens_does_not_change_the_height_from_speeds():
    wide, narrow = filmed(75.0, Straight(3.0)), filmed(50.0, Straight(2.0))
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, awaits_speeds=True, lens=Lens(hfov_deg=75.0)))
    updates = []
    for n, frame in enumerate(wide + narrow):
        if n <= 15:
            estimator.add_speed(n * TENTH, 6.0)
        if n == len(wide):
            estimator.use_lens(Lens(hfov_deg=50.0))
        updates.append(estimator.update(frame, n * TENTH))
    after = [update.travel.distance for update in updates[-10:]]
    assert sum(after) == pytest.approx(6.0, rel=0.05)


def test_a_heading_measured_so_far_stays_when_a_calibration_for_other_images_comes():
    estimator = followed(corner())
    heading = estimator.heading.tracker.heading
    lens = Camera.with_field_of_view(160, 120, 100.0)
    estimator.use_lens(Lens(camera=CameraModel(
        width=160, height=120, fx=lens.focal, fy=lens.focal, cx=lens.cx, cy=lens.cy)))
    assert estimator.heading.tracker.heading == pytest.approx(heading, rel=0.05)
