# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera from rendered drives."""

from dataclasses import asdict, replace
from functools import cache
import math

import cv2
from kitti import grey_pictures
import numpy as np
from phase_traj_ros.core.calibration.lens_calibration import LensCalibration
from phase_traj_ros.core.correlation.phase_correlation import PhaseCorrelator
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
from phase_traj_ros.synthetic.camera import EQUIDISTANT
import pytest

RATE = 10.0
PINHOLE = Camera.with_field_of_view(320, 160, 75.0)
PINHOLE_SHAPE = (160, 320)
FISHEYE = Camera.with_field_of_view(320, 200, 110.0, fisheye=EQUIDISTANT)


@cache
def drive_of(camera, *, angle_deg=75.0, pitch_deg=0.0, seconds=3.0):
    """Return frames of one turn of 15 m, and how far the picture moves before each."""
    speed = 15.0 / seconds
    drive = plan_drive(
        'a turn', [Straight(0.5, speed), Turn(angle_deg, seconds, speed), Straight(0.5, speed)],
        rate_hz=RATE, camera=camera, seed=4)
    poses = drive.poses.copy()
    poses[:, 3] = math.radians(pitch_deg)
    frames = list(render_drive(replace(drive, poses=poses)))
    return frames, [0.0, *(camera.focal * np.diff(poses[:, 2])).tolist()]


def learned(frames, shifts, mask=None, *, reverses=None):
    calibration = LensCalibration()
    calibration.use_mask(mask)
    for (index, (frame, shift)) in enumerate(zip(frames, shifts)):
        calibration.update(frame, shift, 1 / RATE if index else 0.0, reverses=reverses)
    calibration.finish()
    return calibration


def test_before_the_first_turn_nothing_is_certain():
    calibration = LensCalibration()
    calibration.update(np.zeros((160, 320), np.uint8), 0.0, 0.0)
    (low, high) = calibration.estimate.focal_interval_px
    assert low < 100 < 400 < high
    assert calibration.estimate.turns == 0


@pytest.mark.parametrize(('angle_deg', 'seconds'), [(75.0, 3.0), (-75.0, 3.0), (75.0, 24.0)])
def test_one_turn_tells_the_focal_length_at_any_speed(angle_deg, seconds):
    found = learned(*drive_of(PINHOLE, angle_deg=angle_deg, seconds=seconds)).estimate
    assert found.focal_px == pytest.approx(PINHOLE.focal, rel=0.1)
    (low, high) = found.focal_interval_px
    assert low < PINHOLE.focal < high
    assert high / low < 1.2 ** 2
    assert found.straightness == pytest.approx(1.0, abs=0.15)
    assert found.turns >= 1


@pytest.mark.parametrize(('camera', 'angle_deg'), [(PINHOLE, -75.0), (FISHEYE, 75.0)])
def test_a_turn_in_reverse_tells_the_camera(camera, angle_deg):
    frames, shifts = drive_of(camera, angle_deg=angle_deg, pitch_deg=5.0)
    found = learned(
        frames[::-1], [0.0, *(-shift for shift in shifts[:0:-1])], reverses=True).estimate
    assert found.turns >= 1
    assert found.focal_px == pytest.approx(camera.focal, rel=0.1)
    assert found.straightness == pytest.approx(1.0 if camera is PINHOLE else 0.0, abs=0.15)
    assert found.pitch_deg == pytest.approx(5.0, abs=1.5)


def test_a_bend_of_a_motorway_tells_nothing():
    """Parallax explains it with any lens, those of very wide views among them."""
    camera = Camera.with_field_of_view(320, 240, 62.0)
    drive = plan_drive(
        'a bend', [Straight(1.0, 20.0), Turn(20.0, 13.0, 20.0)], rate_hz=RATE, camera=camera,
        seed=5)
    shifts = [0.0, *(camera.focal * np.diff(drive.poses[:, 2])).tolist()]
    assert learned(render_drive(drive), shifts).turns == 0


def test_it_tells_a_fisheye_and_its_tilt():
    found = learned(*drive_of(FISHEYE, pitch_deg=8.0)).estimate
    assert found.focal_px == pytest.approx(FISHEYE.focal, rel=0.1)
    assert found.straightness == pytest.approx(0.0, abs=0.1)
    assert found.pitch_deg == pytest.approx(8.0, abs=1.5)


@pytest.mark.parametrize('angle_deg', [48.0, -75.0])
def test_one_turn_behind_a_van_and_a_cyclist_tells_the_focal_length(angle_deg):
    """They turn, too, and so stay ahead; most of the street is seen beside them."""
    rng = np.random.default_rng(3)
    van, cyclist = (
        cv2.GaussianBlur(rng.integers(0, 256, size, np.uint8), (0, 0), 1.2)
        for size in ((70, 110), (60, 40)))
    frames, shifts = drive_of(PINHOLE, angle_deg=angle_deg)
    busy = []
    for number, frame in enumerate(frames):
        frame = frame.copy()
        for vehicle, left, top in ((van, 100 + 1.5 * number, 60), (cyclist, 230 - 3 * number, 70)):
            height, width = vehicle.shape
            left = min(round(left), 320 - width)
            frame[top:top + height, left:left + width] = vehicle
        busy.append(frame)
    found = learned(busy, shifts).estimate
    assert found.turns >= 1
    assert found.focal_px == pytest.approx(PINHOLE.focal, rel=0.1)
    low, high = found.focal_interval_px
    assert low < PINHOLE.focal < high


def test_shifts_that_are_not_quite_right_do():
    (frames, shifts) = drive_of(PINHOLE)
    rng = np.random.default_rng(0)
    wrong = [1.2 * shift + rng.normal(0, 2) for shift in shifts]
    assert learned(frames, wrong).estimate.focal_px == pytest.approx(PINHOLE.focal, rel=0.1)


def test_a_mirror_makes_no_difference():
    (frames, shifts) = drive_of(PINHOLE)
    mirrored = [np.ascontiguousarray(frame[:, ::-1]) for frame in frames]
    found = learned(mirrored, [-shift for shift in shifts]).estimate
    assert found.focal_px == pytest.approx(PINHOLE.focal, rel=0.1)


def test_the_same_frames_tell_the_same():
    one, other = (asdict(learned(*drive_of(PINHOLE)).estimate) for _ in range(2))
    assert one == other


def test_what_is_masked_is_not_looked_at():
    (frames, shifts) = drive_of(PINHOLE)
    # The lower third shows a mirror, in which all goes the other way.
    spoilt = [
        np.concatenate([frame[:107], np.ascontiguousarray(frame[54:107, ::-1])])
        for frame in frames]
    mask = np.full(PINHOLE_SHAPE, 255, np.uint8)
    mask[107:] = 0
    (masked, free) = (learned(spoilt, shifts, mask=which).estimate for which in (mask, None))
    assert masked.focal_px == pytest.approx(PINHOLE.focal, rel=0.1)
    assert masked.focal_deviation < free.focal_deviation


@pytest.mark.parametrize('frames', [
    [np.zeros(PINHOLE_SHAPE, np.uint8)] * 40,
    list(np.random.default_rng(2).integers(0, 255, (40, *PINHOLE_SHAPE), np.uint8))])
def test_pictures_that_do_not_go_with_the_shifts_tell_nothing(frames):
    assert learned(frames, [0.0, *[8.0] * 39]).estimate.turns == 0


def test_a_vehicle_that_stands_tells_nothing():
    frames = [drive_of(PINHOLE)[0][0]] * 40
    assert learned(frames, [0.0] * 40).estimate.turns == 0
    assert learned(frames, [0.0, *[8.0] * 39]).estimate.turns == 0


def test_a_cut_does_not_join_what_is_on_its_two_sides():
    (frames, shifts) = drive_of(PINHOLE)
    calibration = LensCalibration()
    for (index, (frame, shift)) in enumerate(zip(frames, shifts)):
        if index % 4 == 0:
            calibration.cut()
        calibration.update(frame, shift, 1 / RATE)
    assert calibration.estimate.turns == 0


def test_a_cut_keeps_what_was_learned():
    calibration = learned(*drive_of(PINHOLE))
    before = calibration.estimate
    calibration.cut()
    assert calibration.estimate == before


def test_pictures_of_another_size_are_of_another_camera():
    calibration = learned(*drive_of(PINHOLE))
    frame = cv2.resize(drive_of(PINHOLE)[0][0], (200, 100))
    calibration.update(frame, 0.0, 0.1)
    assert calibration.estimate.turns == 0
    assert calibration.estimate.width == 200


def test_many_turns_are_not_all_looked_at():
    (frames, shifts) = drive_of(PINHOLE)
    (frames, shifts) = (frames[:30], shifts[:30])
    calibration = LensCalibration()
    for _ in range(8):
        calibration.cut()
        for (frame, shift) in zip(frames, shifts):
            calibration.update(frame, shift, 1 / RATE)
    # Of 8 turns or more within 240 frames.
    assert 3 <= calibration.turns <= 7


@pytest.mark.parametrize(('cut', 'column', 'tolerance'), [
    (np.s_[:, :], -13, 0.05), (np.s_[:188], -13, 0.1),
    # Half a picture has its principal point at its edge, and shows half as much of the turn.
    (np.s_[:, :620], 298, 0.12), (np.s_[:, 621:], -324, 0.12)],
    ids=['whole', 'upper half', 'left half', 'right half'])
def test_a_real_turn_tells_the_focal_length(kitti_root, cut, column, tolerance):
    correlator, calibration = PhaseCorrelator(), LensCalibration()
    for picture in grey_pictures(kitti_root / '00')[85:155]:
        frame = np.ascontiguousarray(picture[cut])
        shift = correlator.update(frame)
        calibration.update(frame, 0.0 if shift is None else shift.dx, 0.1)
    calibration.finish()
    found = calibration.estimate
    assert found.focal_px == pytest.approx(718.856, rel=tolerance)
    assert found.column_px == pytest.approx(column, abs=0.05 * found.width)
    assert found.straightness == pytest.approx(1.0, abs=0.2)
