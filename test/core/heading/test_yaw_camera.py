# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is learned of a camera while it drives, and what a compass does with it."""

from dataclasses import replace
import math

import numpy as np
from phase_traj_ros.core.calibration.column_calibration import ColumnCalibration
from phase_traj_ros.core.calibration.lens_calibration import LensCalibration
from phase_traj_ros.core.camera.estimate import CameraEstimate
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.correlation.phase_correlation import Shift
from phase_traj_ros.core.heading.visual_compass import VisualCompass
from phase_traj_ros.core.heading.yaw_camera import YawCamera
from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion, Mounting
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
import pytest
from turning_camera import follow, TENTH, turning


def test_every_stamp_is_told_to_what_is_learned():
    told, learning = [], LensCalibration()
    learning.add_stamp = told.append
    compass = VisualCompass(YawCamera(Lens(hfov_deg=75.0, assumed=True), learning=learning))
    compass.camera.measure(np.zeros((90, 160), np.uint8), 0.1)
    compass.start(5)
    compass.add(None, 5 + TENTH, 0.1)
    assert told == [5, 5 + TENTH]


def test_the_end_of_a_drive_is_told_to_what_is_learned():
    told, learning = [], LensCalibration()
    learning.finish = lambda: told.append(True)
    VisualCompass(YawCamera(Lens(hfov_deg=75.0, assumed=True), learning=learning)).finish()
    assert told


def test_a_vehicle_that_leans_before_a_cut_is_upright_after_it():
    camera = YawCamera(Lens(hfov_deg=75.0))
    camera.measure(np.zeros((90, 160), np.uint8), 0.1)
    leaned = CameraMotion(0.0, 0.0, -0.3, FocusOfExpansion(), 100.0, 0.9, 1e-8, 0.1)
    camera.roll.add(leaned, 0.1, Mounting())
    assert camera.roll.current == -0.3
    camera.cut()
    assert camera.roll.current == 0.0


class _Told(LensCalibration):
    """Learns a camera that is known beforehand from the first two frames."""

    def __init__(self, estimate):
        super().__init__()
        self._estimate = estimate
        self.turns = 1
        self.frames = 0

    estimate = property(lambda self: self._estimate)

    def update(self, frame, shift_px, interval, *, reverses=None):
        self.frames += 1
        return self.frames == 2


FOUND = CameraEstimate(
    width=480, height=360, focal_px=300.0, focal_deviation=0.02, column_px=24.0)


def test_a_lens_that_leaves_nothing_to_measure_is_not_taken():
    _, frames = turning('barrel')
    usual = Lens(hfov_deg=75.0, assumed=True)
    estimator = VisualCompass(YawCamera(usual, learning=_Told(replace(FOUND, focal_px=2.0))))
    headings = follow(estimator, frames)
    assert estimator.camera.lens == usual
    assert np.all(headings == follow(VisualCompass(YawCamera(usual)), frames))


def test_a_camera_is_learned_once_a_turn_has_told():
    learning = _Told(FOUND)
    estimator = VisualCompass(YawCamera(Lens(hfov_deg=75.0, assumed=True), learning=learning))
    assert estimator.camera.learned == FOUND
    learning.turns = 0
    assert estimator.camera.learned is None
    assert VisualCompass(YawCamera(Lens(hfov_deg=75.0))).camera.learned is None


def test_a_camera_is_learned_from_what_is_neither_masked_nor_fixed():
    mask, fixed = np.ones((2, 3), np.float32), np.full((2, 3), 255, np.uint8)
    mask[0, 0], fixed[1, 0] = 0.0, 0
    learning, masks = LensCalibration(), []
    learning.use_mask = masks.append
    compass = VisualCompass(YawCamera(
        Lens(hfov_deg=75.0, assumed=True), mask=mask, learning=learning))
    compass.camera.exclude(fixed)
    assert [each.tolist() for each in masks] == [
        [[0, 255, 255], [255, 255, 255]], [[0, 255, 255], [0, 255, 255]]]


def test_a_lens_that_replaces_a_guess_corrects_what_was_measured_with_it():
    guess = Lens(hfov_deg=75.0, assumed=True)
    compass = VisualCompass(YawCamera(guess, learning=LensCalibration()))
    compass.camera.measure(np.zeros((90, 160), np.uint8), 0.1)
    compass.start(0)
    for pair in range(1, 41):
        yaw = YawMeasurement(Shift(0.0, 0.0, 1.0), 0.05, 1.0)
        compass.add(yaw, pair * TENTH, 0.1)
    assert compass.tracker.heading == pytest.approx(2.0)
    # Twice the focal length is half of all angles; the axis of the turns is 30 degrees aside.
    compass.use_lens(Lens(focal_px=2.0 * guess.focal_for(160), pitch_deg=30.0))
    angle = 1.0 / math.cos(math.radians(30.0))
    assert compass.tracker.heading == pytest.approx(angle)
    assert [math.radians(turn.angle_deg) for turn in compass.finish()] == pytest.approx([angle])


def test_a_lens_that_replaces_a_given_one_leaves_what_was_measured_with_it():
    given = Lens(focal_px=120.0)
    compass = VisualCompass(YawCamera(given, learning=ColumnCalibration(given)))
    compass.camera.measure(np.zeros((90, 160), np.uint8), 0.1)
    compass.start(0)
    for pair in range(1, 41):
        compass.add(YawMeasurement(Shift(0.0, 0.0, 1.0), 0.05, 1.0), pair * TENTH, 0.1)
    compass.use_lens(Lens(focal_px=240.0))
    assert compass.tracker.heading == pytest.approx(2.0)


def test_a_learned_camera_is_taken_even_if_it_is_what_was_guessed():
    _, frames = turning('barrel')
    guess = Lens(hfov_deg=75.0, assumed=True)
    same = replace(FOUND, focal_px=guess.focal_for(480), column_px=0.0)
    for learned, settled in ((same, True), (replace(same, focal_deviation=0.2), False)):
        estimator = VisualCompass(YawCamera(guess, learning=_Told(learned)))
        assert np.isfinite(follow(estimator, frames)).all()
        assert estimator.camera.lens == Lens(estimate=learned)
        assert estimator.camera.in_use.settled is settled
        # The heading is as uncertain as the camera.
        assert estimator.tracker.scale_deviation == learned.focal_deviation


def test_a_camera_learned_upside_down_is_the_same_one_the_right_way_up():
    _, frames = turning('barrel')
    learned = replace(FOUND, pitch_deg=6.0, roll_deg=2.0)
    camera = YawCamera(Lens(hfov_deg=75.0, assumed=True), learning=_Told(learned))
    follow(VisualCompass(camera), frames[:3])
    assert camera.lens == Lens(estimate=learned)
    camera.turn_over(None)
    assert camera.lens == Lens(estimate=replace(learned, column_px=-24.0, pitch_deg=-6.0))
    assert VisualCompass(camera).camera.measure(frames[3], 0.1) is None


class _Column(ColumnCalibration):
    """Learns another column of the principal point from each frame."""

    lens = property(lambda self: Lens(focal_px=300.0, offset=0.02))

    def update(self, frame, shift_px, interval, *, reverses=None):
        return True


def test_a_column_that_is_learned_keeps_the_pitch():
    frame = np.random.default_rng(1).integers(0, 255, (180, 480)).astype(np.uint8)
    given = Lens(focal_px=300.0)
    camera = VisualCompass(YawCamera(given, learning=_Column(given))).camera
    camera.measure(frame, 0.1)
    assert camera.tilt == 1.0
    down = FocusOfExpansion(0.0, -0.3, 1e-5, 1e-5)
    for _ in range(30):
        camera._meter.mounting.add(down, 0.1, 0.0)
    tilt = camera.tilt
    assert tilt == pytest.approx(1.0 / math.hypot(1.0, 0.3), abs=0.002)
    assert camera.learn(TENTH) == 1.0
    assert (camera.lens.offset, camera.tilt) == (0.02, tilt)


class Learner(LensCalibration):
    """Learns nothing, but keeps what it is told of the motion of the picture."""

    def __init__(self):
        super().__init__()
        self.shifts = []

    def update(self, frame, shift_px, interval, *, reverses=None):
        self.shifts.append(shift_px)
        return False


def test_what_is_learned_from_is_the_turn_and_not_what_passes_by():
    camera = Camera.with_field_of_view(320, 180, 130.0)
    drive = plan_drive(
        'a bend', [Straight(0.2), Turn(-60, 8)], rate_hz=15.0, speed=12.0, camera=camera, seed=5)
    learner = Learner()
    # Taken for a usual camera, as in the beginning.
    estimator = VisualCompass(YawCamera(Lens(hfov_deg=75.0, assumed=True), learning=learner))
    for frame in render_drive(drive):
        estimator.camera.measure(np.asarray(frame), 1 / 15)
    assert sum(learner.shifts) == pytest.approx(camera.focal * math.radians(-60), rel=0.15)
