# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The heading of distorted cameras, and frames and lenses that change."""

from dataclasses import replace
import math

import numpy as np
from phase_traj_ros.core.camera.estimate import CameraEstimate
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.correlation.phase_correlation import Shift
from phase_traj_ros.core.heading.visual_compass import VisualCompass
from phase_traj_ros.core.heading.yaw_camera import YawCamera
from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement
from phase_traj_ros.errors import FrameError
import pytest
from turning_camera import BARREL, follow, HEADINGS, STEPS, TENTH, turning


def stepped(index):
    """Return a value to compare with the yaw, in radians, of the frame of that index."""
    return pytest.approx(math.radians(STEPS[index]), abs=0.001)


@pytest.mark.parametrize('upside_down', [False, True])
@pytest.mark.parametrize('name', ['barrel', 'fisheye'])
def test_heading_of_a_distorted_camera(name, upside_down):
    camera, frames = turning(name)
    if upside_down:
        # Of the frames as they arrive; those that are measured are upright.
        camera = camera.turned_180()
    errors = []
    for lens in (Lens(camera=camera), Lens(focal_px=camera.fx)):
        estimator = VisualCompass(YawCamera(lens, rotate_180=upside_down))
        errors.append(np.abs(follow(estimator, frames) - HEADINGS).max())
    known, ignored = errors
    assert known < 0.1
    assert ignored > 4 * known


def test_shift_of_the_picture_is_that_of_its_middle():
    camera, frames = turning('barrel')
    own = YawCamera(Lens(camera=replace(camera)))
    assert own.focal_px == 0.0
    assert own.measure(frames[3], 0.1) is None
    assert own.focal_px == camera.fx
    shift = own.measure(frames[4], 0.1).shift
    assert shift.dx == pytest.approx(camera.fx * math.tan(math.radians(STEPS[4])), abs=0.5)


def test_a_yaw_that_goes_on_is_foreseen():
    camera = CameraModel(width=320, height=240, fx=300.0, fy=200.0, cx=160.0, cy=120.0)
    compass = VisualCompass(YawCamera(Lens(camera=camera)))
    compass.camera.measure(np.zeros(camera.shape, np.uint8), 0.1)
    compass.start(0)
    compass.add(YawMeasurement(Shift(0.0, 0.0, 0.3), 0.02, 1.0), TENTH, 0.1)
    seen = compass.foresee(0.05)
    assert seen.step.heading == pytest.approx(0.03)
    assert compass.camera.shift_by(seen.step.yaw) == pytest.approx(300.0 * math.tan(0.01))
    assert seen.turns == seen.quarters == () and not seen.contradicts


def test_what_a_tilted_camera_does_not_see_of_a_turn_is_added_with_its_error():
    estimate = CameraEstimate(
        width=640, height=480, focal_px=400.0, focal_deviation=0.01, pitch_deg=45.0)
    compass = VisualCompass(YawCamera(Lens(estimate=estimate)))
    compass.start(0)
    measured = YawMeasurement(Shift(0.0, 0.0, 0.3), 0.02, 1.0)
    step = compass.add(measured, TENTH, 0.1).step
    assert step.yaw == pytest.approx(0.02 * math.sqrt(2.0))
    assert step.variance == pytest.approx(2.0 * measured.variance)


@pytest.mark.parametrize(('deviation', 'contradicts'), [(0.02, True), (0.6, False)])
def test_a_direction_contradicts_the_heading_beyond_what_the_lens_explains(
        deviation, contradicts):
    """Two bends of 50 degrees, each too small for a turn, make more than a right angle."""
    compass = VisualCompass(YawCamera(Lens(estimate=CameraEstimate(
        width=160, height=90, focal_px=100.0, focal_deviation=deviation, turns=2))))
    compass.camera.measure(np.zeros((90, 160), np.uint8), 0.1)
    compass.start(0)
    told = []
    for pair in range(1, 101):
        yaw = math.radians(50.0) / 20 if pair % 50 < 20 else 0.0
        told.append(compass.add(
            YawMeasurement(Shift(0.0, 0.0, 1.0), yaw, 1.0), pair * TENTH, 0.1).contradicts)
    assert not any(told[:60]) and told[-1] is contradicts


def test_a_turn_that_a_cut_ends_is_told_once():
    compass = VisualCompass(YawCamera(Lens(hfov_deg=75.0)))
    compass.camera.measure(np.zeros((90, 160), np.uint8), 0.1)
    compass.start(0)
    turning = YawMeasurement(Shift(0.0, 0.0, 1.0), math.radians(4.0), 1.0)
    for pair in range(1, 21):
        assert compass.add(turning, pair * TENTH, 0.1).turns == ()
    compass.cut()
    told = [compass.add(turning, pair * TENTH, 0.1).turns for pair in (21, 22, 23)]
    assert [len(turns) for turns in told] == [1, 0, 0]
    assert told[0][0].angle_deg == pytest.approx(80.0)


def test_the_peak_rate_of_a_turn_has_no_corrections_of_earlier_pairs():
    compass = VisualCompass(YawCamera(Lens(hfov_deg=75.0)))
    compass.camera.measure(np.zeros((90, 160), np.uint8), 0.1)
    compass.start(0)
    # The lens is covered for 0.9 s while the turn begins.
    yaws = [*[0.0] * 10, *[None] * 9, *[math.radians(4.0)] * 20]
    for pair, yaw in enumerate(yaws, start=1):
        update = compass.add(None if yaw is None else YawMeasurement(
            Shift(0.0, 0.0, 1.0), yaw, 1.0,
            CameraMotion(yaw, 0.0, 0.0, FocusOfExpansion(), 100.0, 1.0, 1e-6, 0.05)),
            pair * TENTH, 0.1)
        if pair == 20:
            assert math.degrees(update.step.yaw) > 20.0
    turn, = compass.finish()
    assert turn.angle_deg > 95.0
    assert turn.peak_rate_deg_s == pytest.approx(40.0)


def test_a_frame_that_is_forgotten_is_compared_with_none():
    camera, frames = turning('barrel')
    compass = VisualCompass(YawCamera(Lens(camera=camera)))
    compass.camera.forget_frame()
    compass.camera.measure(frames[0], 0.1)
    compass.camera.forget_frame()
    assert compass.camera.measure(frames[1], 0.1) is None
    assert compass.camera.measure(frames[2], 0.1) is not None


def test_what_is_fixed_stays_left_out_with_another_lens():
    camera, frames = turning('barrel')
    fixed = np.full(frames[0].shape, 255, np.uint8)
    fixed[:, :240] = 0
    agreeing = []
    for weights in (fixed, None):
        compass = VisualCompass(YawCamera(Lens(focal_px=camera.fx)))
        compass.camera.measure(frames[0], 0.1)
        compass.camera.exclude(weights)
        compass.use_lens(Lens(camera=camera))
        compass.camera.measure(frames[1], 0.1)
        agreeing.append(compass.camera.measure(frames[2], 0.1).motion.agreeing)
    assert agreeing[0] == pytest.approx(agreeing[1] / 2, rel=0.2)


def test_before_the_first_frame_there_is_no_map_and_no_camera():
    compass = VisualCompass(YawCamera(Lens(hfov_deg=80.0)))
    assert compass.camera.correlation_map().shape == (0, 0)
    assert compass.camera.in_use is None
    assert not compass.camera.foresees(np.zeros((9, 9), np.uint8), 0.1, 0.1)


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
    estimator = VisualCompass(YawCamera(Lens(camera=camera)))
    half = np.ascontiguousarray(frames[0][::2, ::2])
    message = (r'frames of 240x180 pixels, but the calibration of the camera is for 480x360: '
               'publish the camera_info that belongs to the images, or give focal_px')
    with pytest.raises(FrameError, match=message):
        estimator.camera.measure(half, 0.1)
    # As if it had never come.
    assert estimator.camera.measure(frames[0], 0.1) is None
    with pytest.raises(FrameError, match=message):
        estimator.camera.measure(half, 0.1)
    assert estimator.camera.measure(frames[1], 0.1).yaw == stepped(1)


def test_a_frame_of_another_size_that_is_refused_is_as_if_it_had_never_come():
    _, frames = turning('barrel')
    estimator = VisualCompass(YawCamera(Lens(hfov_deg=60.0)))
    estimator.camera.measure(frames[0], 0.1)
    expected = VisualCompass(YawCamera(Lens(hfov_deg=60.0)))
    expected.camera.measure(frames[0], 0.1)
    with pytest.raises(FrameError, match='show too little'):
        estimator.camera.measure(np.zeros((7, 300), np.uint8), 0.1)
    measured = estimator.camera.measure(frames[1], 0.1)
    assert measured == expected.camera.measure(frames[1], 0.1) is not None


def test_a_restart_forgets_the_heading_and_its_turns_but_not_the_frame():
    camera, frames = turning('barrel')
    estimator = VisualCompass(YawCamera(Lens(camera=camera)))
    follow(estimator, frames[:6])
    estimator.cut()
    estimator.restart()
    estimator.start(6 * TENTH)
    tracker = estimator.tracker
    assert (tracker.heading, tracker.rate, tracker.deviation) == (0.0, 0.0, 0.0)
    update = estimator.add(estimator.camera.measure(frames[6], 0.1), 7 * TENTH, 0.1)
    assert update.step.heading == stepped(6)
    assert estimator.finish() == [] and not estimator.lacks_camera


def test_a_restart_forgets_a_turn_under_way():
    compass = VisualCompass(YawCamera(Lens(hfov_deg=80.0)))
    compass.camera.measure(np.zeros((90, 160), np.uint8), 0.1)
    compass.start(0)
    turning_left = YawMeasurement(Shift(0.0, 0.0, 0.3), math.radians(3.0), 1.0)
    for pair in range(1, 41):
        compass.add(turning_left, pair * TENTH, 0.1)
    compass.restart()
    assert compass.finish() == []


def test_a_cut_ends_the_rate_and_keeps_the_heading():
    camera, frames = turning('barrel')
    estimator = VisualCompass(YawCamera(Lens(camera=camera)))
    heading = follow(estimator, frames[:6])[-1]
    assert estimator.tracker.rate > 0.1
    estimator.cut()
    assert estimator.tracker.rate == 0.0
    assert math.degrees(estimator.tracker.heading) == heading > 5.0


@pytest.mark.parametrize(('angle_deg', 'may_be'), [(30.0, False), (50.0, True)])
def test_a_bend_of_an_unknown_camera_may_be_a_turn(angle_deg, may_be):
    unknown = VisualCompass(YawCamera(Lens(hfov_deg=75.0, assumed=True)))
    known = VisualCompass(YawCamera(Lens(hfov_deg=75.0)))
    for compass in (unknown, known):
        assert not compass.lacks_camera
        compass.camera.measure(np.zeros((90, 160), np.uint8), 0.1)
        compass.start(0)
        for pair in range(1, 101):
            yaw = math.radians(angle_deg) / 25 if pair <= 25 else 0.0
            measured = YawMeasurement(Shift(0.0, 0.0, 1.0), yaw, 1.0)
            compass.add(measured, pair * TENTH, 0.1)
    assert unknown.lacks_camera is may_be
    assert not known.lacks_camera
    unknown.restart()
    assert not unknown.lacks_camera


@pytest.mark.parametrize(('deviation', 'angle_deg', 'in_doubt'), [
    (0.06, 360.0, False), (0.06, 540.0, True), (0.02, 540.0, False), (0.02, 1800.0, True)])
def test_a_learned_camera_leaves_the_quarters_of_a_wide_turn_in_doubt(
        deviation, angle_deg, in_doubt):
    learned = Lens(estimate=CameraEstimate(
        width=160, height=90, focal_px=100.0, focal_deviation=deviation))
    for lens, expected in ((learned, in_doubt), (Lens(focal_px=100.0), False)):
        compass = VisualCompass(YawCamera(lens))
        compass.camera.measure(np.zeros((90, 160), np.uint8), 0.1)
        compass.start(0)
        # The turn does not end.
        for pair in range(1, round(angle_deg / 6.0) + 1):
            compass.add(YawMeasurement(Shift(0.0, 0.0, 1.0), math.radians(6.0), 1.0),
                        pair * TENTH, 0.1)
        assert compass.lacks_camera is expected
        compass.cut()
        assert compass.lacks_camera is expected


def test_another_lens_while_running():
    camera, frames = turning('barrel')
    estimator = VisualCompass(YawCamera(Lens(focal_px=camera.fx)))
    wrong = follow(estimator, frames[:5])[-1]
    estimator.use_lens(Lens(camera=camera))
    assert estimator.camera.lens == Lens(camera=camera)
    # The heading so far is kept, and the next frame has none to be compared with.
    assert math.degrees(estimator.tracker.heading) == wrong
    assert estimator.camera.measure(frames[5], 0.1) is None
    assert math.degrees(estimator.tracker.heading) == wrong
    assert estimator.camera.measure(frames[6], 0.1).yaw == stepped(6)
    # The same lens, read anew, changes nothing.
    estimator.use_lens(Lens(camera=replace(camera)))
    assert estimator.camera.measure(frames[7], 0.1).yaw == stepped(7)
