# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is known of the camera, and the heading of distorted ones."""

from dataclasses import replace
from functools import cache
import math

from far_scene import barrel, BARREL_COEFFICIENTS, fisheye, FISHEYE_COEFFICIENTS, render
import numpy as np
from phase_traj_ros.core.calibration.self_calibration import SelfCalibration
from phase_traj_ros.core.camera.estimate import CameraEstimate
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.camera.model import CameraModel, Distortion
from phase_traj_ros.core.correlation.phase_correlation import Shift
from phase_traj_ros.core.heading.visual_compass import VisualCompass
from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement
from phase_traj_ros.errors import FrameError
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
import pytest

TENTH = 100_000_000
BARREL = CameraModel(
    width=480, height=360, fx=250.0, fy=250.0, cx=240.0, cy=178.0, distortion=Distortion.BROWN,
    coefficients=BARREL_COEFFICIENTS)
FISHEYE = CameraModel(
    width=480, height=360, fx=157.0, fy=157.0, cx=238.0, cy=181.0, distortion=Distortion.FISHEYE,
    coefficients=FISHEYE_COEFFICIENTS)


# Steered as vehicles are: a yaw rate that jumps is not believed.
STEPS = (0.0, 0.5, 1.2, 2.0, 2.7, 3.0, 2.7, 2.0, 1.0, 0.0, -0.8, -1.5, -2.0, -1.5)
HEADINGS = tuple(np.cumsum(STEPS))


@cache
def turning(name):
    """Return the camera and the frames, of which the heading is HEADINGS in degrees."""
    camera, radius = {'barrel': (BARREL, barrel), 'fisheye': (FISHEYE, fisheye)}[name]
    return camera, [
        render(camera, radius, math.radians(heading)) for heading in HEADINGS]


def stepped(index):
    """Return a value to compare with the yaw, in radians, of the frame of that index."""
    return pytest.approx(math.radians(STEPS[index]), abs=0.001)


def follow(estimator, frames):
    """Return the heading in degrees after each of the frames."""
    headings = []
    for index, frame in enumerate(frames):
        measured = estimator.measure(frame, 0.1)
        if index:
            estimator.add(measured, index * TENTH, 0.1)
        else:
            estimator.start(0)
        headings.append(math.degrees(estimator.tracker.heading))
    return np.array(headings)


@pytest.mark.parametrize('upside_down', [False, True])
@pytest.mark.parametrize('name', ['barrel', 'fisheye'])
def test_heading_of_a_distorted_camera(name, upside_down):
    camera, frames = turning(name)
    if upside_down:
        camera = camera.turned_180()
        frames = [np.ascontiguousarray(frame[::-1, ::-1]) for frame in frames]
    errors = []
    for lens in (Lens(camera=camera), Lens(focal_px=camera.fx)):
        estimator = VisualCompass(lens, rotate_180=upside_down)
        errors.append(np.abs(follow(estimator, frames) - HEADINGS).max())
    known, ignored = errors
    assert known < 0.1
    assert ignored > 4 * known


def test_shift_of_the_picture_is_that_of_its_middle():
    camera, frames = turning('barrel')
    estimator = VisualCompass(Lens(camera=replace(camera)))
    assert estimator.focal_px == 0.0
    assert estimator.measure(frames[3], 0.1) is None
    assert estimator.focal_px == camera.fx
    update = estimator.add(estimator.measure(frames[4], 0.1), TENTH, 0.1)
    assert update.shift.dx == pytest.approx(camera.fx * math.tan(math.radians(STEPS[4])), abs=0.5)


def test_a_foreseen_shift_is_that_of_a_yaw_that_goes_on():
    camera = CameraModel(width=320, height=240, fx=300.0, fy=200.0, cx=160.0, cy=120.0)
    compass = VisualCompass(Lens(camera=camera))
    compass.measure(np.zeros(camera.shape, np.uint8), 0.1)
    compass.start(0)
    compass.add(YawMeasurement(Shift(0.0, 0.0, 0.3), 0.02, True, 1.0), TENTH, 0.1)
    seen = compass.foresee(0.05)
    assert seen.step.heading == pytest.approx(0.03)
    assert (seen.shift.dx, seen.shift.dy) == pytest.approx((300.0 * math.tan(0.01), 0.0))
    assert seen.shift.response == 0.3
    assert seen.turns == seen.quarters == () and not seen.contradicts


@pytest.mark.parametrize(('deviation', 'contradicts'), [(0.02, True), (0.6, False)])
def test_a_direction_contradicts_the_heading_beyond_what_the_lens_explains(
        deviation, contradicts):
    """Two bends of 50 degrees, each too small for a turn, make more than a right angle."""
    compass = VisualCompass(Lens(estimate=CameraEstimate(
        width=160, height=90, focal_px=100.0, focal_deviation=deviation, turns=2)))
    compass.measure(np.zeros((90, 160), np.uint8), 0.1)
    compass.start(0)
    told = []
    for pair in range(1, 101):
        yaw = math.radians(50.0) / 20 if pair % 50 < 20 else 0.0
        told.append(compass.add(
            YawMeasurement(Shift(0.0, 0.0, 1.0), yaw, True, 1.0), pair * TENTH, 0.1).contradicts)
    assert not any(told[:60]) and told[-1] is contradicts


def test_a_turn_that_a_cut_ends_is_told_once():
    compass = VisualCompass(Lens(hfov_deg=75.0))
    compass.measure(np.zeros((90, 160), np.uint8), 0.1)
    compass.start(0)
    turning = YawMeasurement(Shift(0.0, 0.0, 1.0), math.radians(4.0), True, 1.0)
    for pair in range(1, 21):
        assert compass.add(turning, pair * TENTH, 0.1).turns == ()
    compass.cut()
    told = [compass.add(turning, pair * TENTH, 0.1).turns for pair in (21, 22, 23)]
    assert [len(turns) for turns in told] == [1, 0, 0]
    assert told[0][0].angle_deg == pytest.approx(80.0)


def test_a_frame_that_is_forgotten_is_compared_with_none():
    camera, frames = turning('barrel')
    compass = VisualCompass(Lens(camera=camera))
    compass.forget_frame()
    compass.measure(frames[0], 0.1)
    compass.forget_frame()
    assert compass.measure(frames[1], 0.1) is None
    assert compass.measure(frames[2], 0.1) is not None


@pytest.mark.parametrize('upside_down', [False, True])
def test_a_camera_is_learned_from_upright_frames(upside_down):
    frame = np.random.default_rng(0).integers(0, 255, (90, 160)).astype(np.uint8)
    seen, learning = [], SelfCalibration()
    learning.update = lambda frame, shift_px, interval: bool(seen.append(frame))
    compass = VisualCompass(
        Lens(hfov_deg=75.0, assumed=True), rotate_180=upside_down, learning=learning)
    compass.measure(frame[::-1, ::-1].copy() if upside_down else frame, 0.1)
    assert np.array_equal(seen, [frame])


def test_what_is_fixed_stays_left_out_with_another_lens():
    camera, frames = turning('barrel')
    fixed = np.full(frames[0].shape, 255, np.uint8)
    fixed[:, :240] = 0
    agreeing = []
    for weights in (fixed, None):
        compass = VisualCompass(Lens(focal_px=camera.fx))
        compass.measure(frames[0], 0.1)
        compass.leave_out(weights)
        compass.use_lens(Lens(camera=camera))
        compass.measure(frames[1], 0.1)
        agreeing.append(compass.measure(frames[2], 0.1).motion.agreeing)
    assert agreeing[0] == pytest.approx(agreeing[1] / 2, rel=0.2)


def test_a_bend_that_has_ended_is_told_to_what_is_learned():
    guess, told, learning = Lens(hfov_deg=75.0, assumed=True), [], SelfCalibration()
    learning.add_turn = lambda angle_deg, *, focal_px: told.append((angle_deg, focal_px))
    compass = VisualCompass(guess, learning=learning)
    compass.measure(np.zeros((90, 160), np.uint8), 0.1)
    compass.start(0)
    for pair in range(1, 41):
        yaw = math.radians(-40.0) / 20 if pair <= 20 else 0.0
        compass.add(YawMeasurement(Shift(0.0, 0.0, 1.0), yaw, True, 1.0), pair * TENTH, 0.1)
    assert told == [(pytest.approx(-40.0), guess.focal_for(160))]


def test_the_end_of_a_drive_is_told_to_what_is_learned():
    told, learning = [], SelfCalibration()
    learning.finish = lambda: told.append(True)
    VisualCompass(Lens(hfov_deg=75.0, assumed=True), learning=learning).finish()
    assert told


def test_before_the_first_frame_there_is_no_map_and_no_camera():
    compass = VisualCompass(Lens(hfov_deg=80.0))
    assert compass.correlation_map().shape == (0, 0)
    assert compass.camera is None and not compass.foresees(np.zeros((9, 9), np.uint8), 0.1, 0.1)
    with pytest.raises(ValueError, match='before the first frame'):
        _ = compass.model


def test_what_is_given_counts_before_a_calibration():
    shape = BARREL.shape
    assert Lens(camera=BARREL).camera_for(shape) is BARREL
    assert Lens(camera=BARREL).focal_for(480) == 250.0
    for known in ({}, {'camera': BARREL}):
        lens = Lens(focal_px=300.0, hfov_deg=90.0, **known)
        assert lens.focal_for(480) == 300.0
        assert lens.camera_for(shape) == CameraModel.pinhole(shape, 300.0)
        lens = Lens(hfov_deg=80.0, **known)
        assert lens.focal_for(480) == pytest.approx(240.0 / math.tan(math.radians(40.0)))
        assert lens.camera_for(shape) == CameraModel.pinhole(shape, lens.focal_for(480))
    # And fit frames of any size.
    assert Lens(focal_px=300.0, camera=BARREL).camera_for((100, 200)).shape == (100, 200)


@pytest.mark.parametrize(('values', 'message'), [
    ({}, 'neither focal_px nor hfov_deg nor a calibration'),
    ({'camera': None}, 'give one of them'),
    ({'focal_px': -1.0, 'camera': BARREL}, 'focal_px is -1'),
    ({'focal_px': math.nan}, 'focal_px is nan'),
    ({'focal_px': 1e300}, 'at most 1e'),
    ({'hfov_deg': 5e-324}, 'hfov_deg is 5e-324'),
    ({'hfov_deg': 180.0, 'camera': BARREL}, 'hfov_deg is 180'),
])
def test_refuses_what_cannot_be(values, message):
    with pytest.raises(ValueError, match=message):
        Lens(**values)


def test_frames_of_another_size_than_the_calibration():
    camera, frames = turning('barrel')
    estimator = VisualCompass(Lens(camera=camera))
    half = np.ascontiguousarray(frames[0][::2, ::2])
    message = (r'frames of 240x180 pixels, but the calibration of the camera is for 480x360: '
               'publish the camera_info that belongs to the images, or give focal_px')
    with pytest.raises(FrameError, match=message):
        estimator.measure(half, 0.1)
    # As if it had never come.
    assert estimator.measure(frames[0], 0.1) is None
    with pytest.raises(FrameError, match=message):
        estimator.measure(half, 0.1)
    assert estimator.measure(frames[1], 0.1).yaw == stepped(1)


def test_a_frame_of_another_size_that_is_refused_is_as_if_it_had_never_come():
    _, frames = turning('barrel')
    estimator = VisualCompass(Lens(hfov_deg=60.0))
    estimator.measure(frames[0], 0.1)
    expected = VisualCompass(Lens(hfov_deg=60.0))
    expected.measure(frames[0], 0.1)
    with pytest.raises(FrameError, match='NaN'):
        estimator.measure(np.full((200, 300), np.nan, np.float32), 0.1)
    assert estimator.measure(frames[1], 0.1) == expected.measure(frames[1], 0.1) is not None


class _Told(SelfCalibration):
    """Learns a camera that is known beforehand from the first two frames."""

    def __init__(self, estimate):
        super().__init__()
        self._estimate = estimate
        self.frames = 0

    estimate = property(lambda self: self._estimate)
    turns = 1

    def update(self, frame, shift_px, interval):
        self.frames += 1
        return self.frames == 2


FOUND = CameraEstimate(
    width=480, height=360, focal_px=300.0, focal_deviation=0.02, column_px=24.0)


def test_a_lens_that_leaves_nothing_to_measure_is_not_taken():
    _, frames = turning('barrel')
    usual = Lens(hfov_deg=75.0, assumed=True)
    estimator = VisualCompass(usual, learning=_Told(replace(FOUND, focal_px=2.0)))
    headings = follow(estimator, frames)
    assert estimator.lens == usual
    assert np.all(headings == follow(VisualCompass(usual), frames))


def test_a_camera_is_learned_once_a_turn_has_told():
    learning = _Told(FOUND)
    estimator = VisualCompass(Lens(hfov_deg=75.0, assumed=True), learning=learning)
    assert estimator.learned == FOUND
    learning.turns = 0
    assert estimator.learned is None
    assert VisualCompass(Lens(hfov_deg=75.0)).learned is None


def test_a_restart_forgets_the_heading_and_its_turns_but_not_the_frame():
    camera, frames = turning('barrel')
    estimator = VisualCompass(Lens(camera=camera))
    follow(estimator, frames[:6])
    estimator.cut()
    estimator.restart()
    estimator.start(6 * TENTH)
    tracker = estimator.tracker
    assert (tracker.heading, tracker.rate, tracker.deviation) == (0.0, 0.0, 0.0)
    update = estimator.add(estimator.measure(frames[6], 0.1), 7 * TENTH, 0.1)
    assert update.step.heading == stepped(6)
    assert estimator.finish() == [] and not estimator.bends_may_be_turns


@pytest.mark.parametrize('upside_down', [False, True])
def test_a_camera_is_learned_from_what_is_neither_masked_nor_fixed(upside_down):
    mask, fixed = np.ones((2, 3), np.float32), np.full((2, 3), 255, np.uint8)
    mask[0, 0], fixed[1, 0] = 0.0, 0
    learning, masks = SelfCalibration(), []
    learning.use_mask = masks.append
    compass = VisualCompass(
        Lens(hfov_deg=75.0, assumed=True), rotate_180=upside_down, mask=mask, learning=learning)
    compass.leave_out(fixed)
    # Points are tracked in the upright frame.
    upright = slice(None, None, -1) if upside_down else slice(None)
    seen = [each[upright, upright].tolist() for each in masks]
    assert seen == [
        [[0, 255, 255], [255, 255, 255]], [[0, 255, 255], [0, 255, 255]]]


def test_a_cut_ends_the_rate_and_keeps_the_heading():
    camera, frames = turning('barrel')
    estimator = VisualCompass(Lens(camera=camera))
    heading = follow(estimator, frames[:6])[-1]
    assert estimator.tracker.rate > 0.1
    estimator.cut()
    assert estimator.tracker.rate == 0.0
    assert math.degrees(estimator.tracker.heading) == heading > 5.0


@pytest.mark.parametrize(('angle_deg', 'may_be'), [(30.0, False), (50.0, True)])
def test_a_bend_of_an_unknown_camera_may_be_a_turn(angle_deg, may_be):
    unknown = VisualCompass(Lens(hfov_deg=75.0, assumed=True))
    known = VisualCompass(Lens(hfov_deg=75.0))
    for compass in (unknown, known):
        assert not compass.bends_may_be_turns
        compass.measure(np.zeros((90, 160), np.uint8), 0.1)
        compass.start(0)
        for pair in range(1, 101):
            yaw = math.radians(angle_deg) / 25 if pair <= 25 else 0.0
            measured = YawMeasurement(Shift(0.0, 0.0, 1.0), yaw, True, 1.0)
            compass.add(measured, pair * TENTH, 0.1)
    assert unknown.bends_may_be_turns is may_be
    assert not known.bends_may_be_turns
    unknown.restart()
    assert not unknown.bends_may_be_turns


def test_a_lens_that_replaces_a_guess_corrects_what_was_measured_with_it():
    guess = Lens(hfov_deg=75.0, assumed=True)
    compass = VisualCompass(guess, learning=SelfCalibration())
    compass.measure(np.zeros((90, 160), np.uint8), 0.1)
    compass.start(0)
    for pair in range(1, 41):
        yaw = YawMeasurement(Shift(0.0, 0.0, 1.0), 0.05, True, 1.0)
        compass.add(yaw, pair * TENTH, 0.1)
    assert compass.tracker.heading == pytest.approx(2.0)
    # Twice the focal length is half of all angles; the axis of the turns is 30 degrees aside.
    compass.use_lens(Lens(focal_px=2.0 * guess.focal_for(160), pitch_deg=30.0))
    angle = 1.0 / math.cos(math.radians(30.0))
    assert compass.tracker.heading == pytest.approx(angle)
    assert [math.radians(turn.angle_deg) for turn in compass.finish()] == pytest.approx([angle])


def test_a_learned_camera_is_taken_even_if_it_is_what_was_guessed():
    _, frames = turning('barrel')
    guess = Lens(hfov_deg=75.0, assumed=True)
    same = replace(FOUND, focal_px=guess.focal_for(480), column_px=0.0)
    for learned, settled in ((same, True), (replace(same, focal_deviation=0.2), False)):
        estimator = VisualCompass(guess, learning=_Told(learned))
        assert np.isfinite(follow(estimator, frames)).all()
        assert estimator.lens == Lens(estimate=learned)
        assert estimator.camera.settled is settled


@pytest.mark.parametrize('shape', [(0, 4), (40, 40, 3), (40,)])
def test_what_is_no_frame(shape):
    with pytest.raises(FrameError, match='give grey frames'):
        VisualCompass(Lens(hfov_deg=80.0)).measure(np.zeros(shape, np.uint8), 0.1)


def test_another_lens_while_running():
    camera, frames = turning('barrel')
    estimator = VisualCompass(Lens(focal_px=camera.fx))
    wrong = follow(estimator, frames[:5])[-1]
    estimator.use_lens(Lens(camera=camera))
    assert estimator.lens == Lens(camera=camera)
    # The heading so far is kept, and the next frame has none to be compared with.
    assert math.degrees(estimator.tracker.heading) == wrong
    assert estimator.measure(frames[5], 0.1) is None
    assert math.degrees(estimator.tracker.heading) == wrong
    assert estimator.measure(frames[6], 0.1).yaw == stepped(6)
    # The same lens, read anew, changes nothing.
    estimator.use_lens(Lens(camera=replace(camera)))
    assert estimator.measure(frames[7], 0.1).yaw == stepped(7)


class Learner(SelfCalibration):
    """Learns nothing, but keeps what it is told of the motion of the picture."""

    def __init__(self):
        super().__init__()
        self.shifts = []

    def update(self, frame, shift_px, interval):
        self.shifts.append(shift_px)
        return False


def test_what_is_learned_from_is_the_turn_and_not_what_passes_by():
    camera = Camera.with_field_of_view(320, 180, 130.0)
    drive = plan_drive(
        'a bend', [Straight(0.2), Turn(-60, 8)], rate_hz=15.0, speed=12.0, camera=camera, seed=5)
    learner = Learner()
    # Taken for a usual camera, as in the beginning.
    estimator = VisualCompass(Lens(hfov_deg=75.0, assumed=True), learning=learner)
    for frame in render_drive(drive):
        estimator.measure(np.asarray(frame), 1 / 15)
    assert sum(learner.shifts) == pytest.approx(camera.focal * math.radians(-60), rel=0.15)


LEARNED = Lens(estimate=CameraEstimate(
    width=320, height=240, focal_px=250.0, focal_deviation=0.03, turns=2))


class Learning(SelfCalibration):

    def __init__(self):
        super().__init__()
        self.travels = []

    def add_travel(self, slope, deviation):
        self.travels.append((slope, deviation))


@pytest.mark.parametrize(('lens', 'yaw', 'passing', 'learns'), [
    (LEARNED, 0.0, 0.05, True),
    (LEARNED, 0.02, 0.05, False),
    (LEARNED, 0.0, 0.001, False),
    (Lens(hfov_deg=75.0, assumed=True), 0.0, 0.05, False)])
def test_the_direction_of_travel_tells_the_pitch_of_a_learned_camera(lens, yaw, passing, learns):
    learning = Learning()
    estimator = VisualCompass(lens, learning=learning)
    frame = np.random.default_rng(0).integers(0, 255, (240, 320)).astype(np.uint8)
    estimator.measure(frame, 0.0)
    motion = CameraMotion(
        yaw, 0.0, 0.0, FocusOfExpansion(slope=-0.05, slope_variance=0.004 ** 2), 100.0, 1.0,
        1e-8, passing)
    estimator.add(YawMeasurement(Shift(0.0, 0.0, 0.1), yaw, True, 1.0, motion), 10**8, 0.1)
    assert learning.travels == ([(-0.05, pytest.approx(0.004))] if learns else [])
