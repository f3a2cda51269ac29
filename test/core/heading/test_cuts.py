# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A change of scene is told from what else spoils pairs of frames."""

import math

import cv2
import numpy as np
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.correlation.phase_correlation import Shift
from phase_traj_ros.core.heading.cuts import CutDetector
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement, YawMeter
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
from phase_traj_ros.synthetic.degradations import fog, gain, sensor_noise
import pytest

CAMERA = Camera.with_field_of_view(320, 240, 70)
FOCAL = 160 / math.tan(math.radians(35))


def drive_of(seed, *plan):
    drive = plan_drive('a drive', list(plan), rate_hz=10.0, camera=CAMERA, speed=8.0, seed=seed)
    return list(render_drive(drive))


@pytest.fixture(scope='module')
def scenes():
    return [drive_of(1, Straight(1.0), Turn(90.0, 3.0, 4.5)), drive_of(2, Straight(2.5)),
            drive_of(3, Turn(-90.0, 3.0, 4.5))]


def cuts_of(frames, *, intervals=None):
    """Return the numbers of the pairs across which the scene has changed."""
    meter = YawMeter(CylinderProjection(CameraModel.pinhole((240, 320), FOCAL)))
    detector, found = CutDetector(), []
    for number, frame in enumerate(frames):
        interval = 0.1 if intervals is None else intervals[number]
        measured = meter.update(frame, interval)
        if measured is not None and detector.update(measured, interval):
            found.append(number - 2)
    return found


def test_each_cut_of_a_film_is_found_and_nothing_else(scenes):
    first, second, third = scenes
    film = [*first, *second, *third, *first[:15]]
    expected = np.cumsum([len(first), len(second), len(third)]) - 1
    assert cuts_of(film) == expected.tolist()


def test_a_cut_in_the_middle_of_a_turn_is_found(scenes):
    turning = scenes[0][:25]
    assert cuts_of([*turning, *scenes[2][10:]]) == [24]


@pytest.mark.parametrize('every', [1, 3])
@pytest.mark.parametrize('spoil', [
    lambda frame, number: frame,
    lambda frame, number: sensor_noise(frame, sigma=20.0, seed=number),
    lambda frame, number: gain(frame, factor=0.5 + (number % 7) / 6),
    lambda frame, number: fog(frame, visibility=25.0, camera=CAMERA)])
def test_a_drive_has_no_cuts_however_bad_the_pictures(scenes, spoil, every):
    for scene in scenes:
        frames = [spoil(frame, number) for number, frame in enumerate(scene)]
        assert cuts_of(frames[::every]) == []


def test_a_covered_lens_is_not_a_cut(scenes):
    frames = list(scenes[0])
    for number in range(15, 20):
        frames[number] = sensor_noise(np.zeros((240, 320), np.uint8), sigma=3.0, seed=number)
    assert cuts_of(frames) == []


def test_a_lorry_that_passes_is_not_a_cut(scenes):
    side = cv2.GaussianBlur(
        np.random.default_rng(5).integers(0, 255, (200, 220)).astype(np.uint8), (0, 0), 3)

    def passed(number, frame):
        hidden = frame.copy()
        left = -220 + 60 * (number - 8)
        inside = slice(max(left, 0), max(min(left + 220, 320), 0))
        if inside.start < inside.stop:
            hidden[:200, inside] = side[:, inside.start - left:inside.stop - left]
        return hidden

    assert cuts_of([passed(*each) for each in enumerate(scenes[1])]) == []


def test_lost_frames_that_the_stamps_tell_of_are_not_a_cut(scenes):
    first, second, _ = scenes
    intervals = [0.1] * (len(first) + len(second))
    intervals[len(first)] = 2.0
    assert cuts_of([*first, *second], intervals=intervals) == []


def pair(agreement, *, yaw=None):
    return YawMeasurement(Shift(0.0, 0.0, 0.1), yaw, agreement)


def test_pairs_that_were_not_compared_are_not_cuts():
    good, bad = pair(0.9, yaw=0.01), pair(0.02)
    detector = CutDetector()
    given = (good, good, bad, None, good, good, bad, good)
    assert [detector.update(each, 0.1) for each in given] == [False] * 7 + [True]
    detector.update(bad, 0.1)
    detector.reset()
    assert not detector.update(good, 0.1)


def test_a_pair_whose_shift_stands_out_is_not_a_cut():
    detector = CutDetector()
    given = (pair(0.5, yaw=0.01), pair(0.05, yaw=0.0), pair(0.5, yaw=0.01))
    assert not any(detector.update(each, 0.3) for each in given)


def test_the_end_of_a_dark_part_is_not_a_cut_although_some_of_its_noise_agrees():
    detector = CutDetector()
    given = (pair(0.9, yaw=0.01), pair(0.2), pair(0.4), pair(0.0), pair(0.9, yaw=0.01))
    assert not any(detector.update(each, 0.1) for each in given)
