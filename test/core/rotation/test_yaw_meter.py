# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Yaw, heading and turns from pictures: rendered drives whose truth is known, and KITTI."""

from copy import deepcopy
from functools import cache
import math

import cv2
from kitti import grey_pictures
import numpy as np
import overlays
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.codes.from_heading import HeadingCode
from phase_traj_ros.core.heading.tracker import HeadingTracker
from phase_traj_ros.core.heading.turns import find_turns
from phase_traj_ros.core.rotation.yaw_meter import YawMeter
from phase_traj_ros.errors import FrameError
from phase_traj_ros.synthetic import (
    Camera,
    plan_drive,
    poses_from_kitti,
    render_drive,
    Straight,
    Turn,
)
from phase_traj_ros.synthetic.degradations import rain, sensor_noise
import pytest

CAMERA = Camera.with_field_of_view(320, 240, 70.0)
PLAN = (
    Straight(1.0), Turn(90, 2.5, 4.0), Straight(0.8), Turn(-100, 3.0, 4.0), Straight(1.0, 0.0),
    Straight(1.0))


@cache
def rendered():
    drive = plan_drive('left_right_wait', PLAN, rate_hz=10.0, speed=7.0, camera=CAMERA, seed=4)
    return drive, list(render_drive(drive))


def cylinder(shape, focal_px, **options):
    return CylinderProjection(CameraModel.pinhole(shape, focal_px), **options)


def follow(frames, stamps_ns, focal_px, *, speed=None, **options):
    """Return the headings in degrees, the tracker, the code and the turns of a drive."""
    meter = YawMeter(cylinder(frames[0].shape, focal_px), **options)
    tracker, code, headings = HeadingTracker(), HeadingCode(), [0.0]
    meter.update(frames[0], 0.1)
    for frame, interval_ns in zip(frames[1:], np.diff(stamps_ns).tolist()):
        interval = interval_ns / 1e9
        measured = meter.update(frame, interval, speed=speed)
        step = tracker.update(measured.yaw, interval)
        code.update(step.heading, step.rate)
        headings.append(step.heading)
    turns = find_turns(stamps_ns, headings)
    return np.degrees(headings), tracker, code, turns


def changes(code):
    return [int(each) for each in code.movement if each in (0, 2)]


def test_follows_a_rendered_drive():
    drive, frames = rendered()
    headings, tracker, code, turns = follow(frames, drive.stamps_ns.tolist(), CAMERA.focal)
    error = headings - np.degrees(drive.poses[:, 2])
    assert np.abs(error).max() < 1.5
    assert np.sqrt(np.mean(np.diff(error) ** 2)) < 0.05
    assert tracker.bridged == 0
    assert [turn.angle_deg for turn in turns] == pytest.approx([90, -100], abs=3.0)
    assert changes(code) == [0, 2]


def test_follows_it_in_the_mirror():
    drive, frames = rendered()
    mirrored = [np.ascontiguousarray(frame[:, ::-1]) for frame in frames]
    headings, _, code, _ = follow(mirrored, drive.stamps_ns.tolist(), CAMERA.focal)
    assert np.abs(headings + np.degrees(drive.poses[:, 2])).max() < 1.5
    assert changes(code) == [2, 0]


def test_follows_it_when_frames_are_lost():
    drive, frames = rendered()
    kept = np.flatnonzero(np.random.default_rng(1).random(len(drive)) > 0.4)
    headings, _, _, turns = follow(
        [frames[index] for index in kept], drive.stamps_ns[kept].tolist(), CAMERA.focal)
    truth = np.degrees(drive.poses[kept, 2] - drive.poses[kept[0], 2])
    assert np.abs(headings - truth).max() < 3.0
    assert len(turns) == 2


def test_patterns_fixed_to_the_camera_do_not_hold_it():
    drive, frames = rendered()
    spoilt = []
    rng = np.random.default_rng(0)
    bonnet = cv2.GaussianBlur(rng.integers(0, 255, (60, 320)).astype(np.uint8), (5, 5), 0)
    for frame in frames:
        frame = frame.copy()
        frame[:22, :130] = 0
        cv2.putText(
            frame, '12:34:56 CAM 1', (4, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.45, 255, 1)
        frame[-60:] = bonnet
        spoilt.append(frame)
    headings, _, _, turns = follow(spoilt, drive.stamps_ns.tolist(), CAMERA.focal)
    assert np.abs(headings - np.degrees(drive.poses[:, 2])).max() < 4.0
    assert len(turns) == 2


@pytest.mark.parametrize('seed', [1, 2])
def test_blocks_that_follow_drops_on_the_windscreen_do_not_hold_it(seed):
    drive, frames = rendered()
    wet = [overlays.drops(frame, count=100, size=0.03, seed=seed) for frame in frames]
    stamps = drive.stamps_ns.tolist()
    *_, turns = follow(wet, stamps, CAMERA.focal, speed=5.0)
    # They cover more than a third of the view.
    assert [turn.angle_deg for turn in turns] == pytest.approx([90, -100], abs=30.0)
    # If the vehicle may stand, people before it could move the second peak.
    *_, turns = follow(wet, stamps, CAMERA.focal)
    assert len(turns) < 2


def test_a_real_road_driven_in_reverse(kitti_root):
    frames = grey_pictures(kitti_root / '06')[::-1]
    truth = np.degrees(poses_from_kitti(np.loadtxt(kitti_root / '06' / 'poses.txt'))[::-1, 2])
    stamps = [100_000_000 * number for number in range(len(frames))]
    for speed in (None, -5.0):
        headings, tracker, *_ = follow(frames, stamps, 707.1, speed=speed)
        # As forward. Where all must pass from front to rear, no blocks agree: 16 degrees.
        assert np.abs(headings - (truth - truth[0])).max() < 1.0
        assert tracker.bridged == 0


@pytest.mark.parametrize(('speed', 'reverses'), [
    (None, True), (-1.0, True), (0.0, False), (1.0, False)])
def test_a_scene_that_recedes_is_reverse_unless_the_road_contradicts(speed, reverses):
    """It may be traffic that overtakes a slow vehicle, or drives off from a standing one."""
    _, frames = rendered()
    meter = YawMeter(cylinder(frames[0].shape, CAMERA.focal))
    found = [meter.update(frame, 0.1, speed=speed) for frame in frames[40:10:-1]][1:]
    assert all(each.reverses and each.certain for each in found) == reverses
    assert any(each.reverses for each in found) == reverses


def test_a_mask_takes_out_what_it_covers():
    drive, frames = rendered()
    mask = np.ones(frames[0].shape, np.float32)
    mask[:, 100:220] = 0.0
    rng = np.random.default_rng(0)
    spoilt = [
        np.where(mask > 0, frame, rng.integers(0, 255, frame.shape)).astype(np.uint8)
        for frame in frames]
    headings, _, _, turns = follow(spoilt, drive.stamps_ns.tolist(), CAMERA.focal, mask=mask)
    # Without the direction of travel in view: 1 to 9 degrees, by what the mask covers.
    assert np.abs(headings - np.degrees(drive.poses[:, 2])).max() < 10.0
    assert len(turns) == 2


def test_flicker_of_the_exposure_does_not_matter():
    drive, frames = rendered()
    flickering = [
        cv2.convertScaleAbs(frame, alpha=0.8 + 0.25 * math.sin(1.7 * index))
        for index, frame in enumerate(frames)]
    headings, _, _, _ = follow(flickering, drive.stamps_ns.tolist(), CAMERA.focal)
    assert np.abs(headings - np.degrees(drive.poses[:, 2])).max() < 2.5


def test_rain_in_a_corner_does_not_turn_the_direction_of_travel():
    """If it did, the yaw would follow it, by the more the longer the corner lasts."""
    drive, frames = rendered()
    most = []
    for seed in (3, 6):
        wet = [
            rain(frame, streaks=1000, seed=(seed, number)) for number, frame in enumerate(frames)]
        headings, _, _, turns = follow(wet, drive.stamps_ns.tolist(), CAMERA.focal)
        assert [turn.quarter_turns for turn in turns] == [1, -1]
        most.append(np.abs(headings - np.degrees(drive.poses[:, 2])).max())
    # About 7.5; 12 if the direction of travel is not limited. It depends on every drop.
    assert np.mean(most) < 9.5


def test_noise_takes_no_keyframe_from_a_slow_camera():
    drive = plan_drive('walk', [Straight(1.5)], rate_hz=60.0, speed=1.4, camera=CAMERA, seed=3)
    meter = YawMeter(cylinder((CAMERA.height, CAMERA.width), CAMERA.focal))
    noisy = (
        sensor_noise(frame, sigma=24.0, seed=number)
        for number, frame in enumerate(render_drive(drive)))
    measured = list(filter(None, (meter.update(frame, 1 / 60) for frame in noisy)))
    # A clear camera replaces its keyframe every half second, i.e. 30 pairs.
    assert np.mean([each.share == 1.0 for each in measured]) < 0.1
    assert np.median([each.share for each in measured]) < 0.15


def test_nothing_to_see_is_no_measurement():
    _, frames = rendered()
    meter = YawMeter(cylinder(frames[0].shape, CAMERA.focal))
    dark = np.zeros_like(frames[0])
    assert meter.update(dark, 0.1) is None
    assert meter.update(dark, 0.1).yaw is None
    noise = np.random.default_rng(0).integers(0, 255, (2, *dark.shape)).astype(np.uint8)
    meter.update(noise[0], 0.1)
    unrelated = meter.update(noise[1], 0.1)
    assert unrelated.yaw is None and unrelated.motion is None


def test_a_turn_goes_on_where_only_the_shift_is_seen(monkeypatch):
    drive, frames = rendered()
    turning = int(np.argmax(np.gradient(drive.poses[:, 2])))
    dark = np.zeros_like(frames[turning])
    for frame, goes_on in ((frames[turning], True), (dark, False)):
        meter = YawMeter(cylinder(frame.shape, CAMERA.focal))
        for before in frames[turning - 8:turning]:
            meter.update(before, 0.1)
        rate = meter.roll.yaw_rate
        with monkeypatch.context() as blind:
            blind.setattr(YawMeter, '_match_keyframe', lambda *_: None)
            measured = meter.update(frame, 0.1)
        assert measured.motion is None and (measured.yaw is not None) is goes_on
        assert (meter.roll.yaw_rate == pytest.approx(rate, rel=0.01)) is goes_on


def test_a_still_picture_is_no_yaw():
    _, frames = rendered()
    meter = YawMeter(cylinder(frames[0].shape, CAMERA.focal))
    meter.update(frames[5], 0.1)
    measured = meter.update(frames[5], 0.1)
    assert measured.yaw == pytest.approx(0.0, abs=1e-6)
    assert measured.agreement == 1.0 and measured.motion is not None


def test_a_frame_that_cannot_be_used_changes_nothing():
    _, frames = rendered()
    meter, other = (
        YawMeter(cylinder(frames[0].shape, CAMERA.focal)) for _ in range(2))
    meter.update(frames[10], 0.1)
    other.update(frames[10], 0.1)
    spoilt = frames[11].astype(np.float32)
    spoilt[100, 100] = np.nan
    with pytest.raises(FrameError):
        meter.update(spoilt, 0.1)
    assert meter.update(frames[11], 0.1) == other.update(frames[11], 0.1)


def test_refuses_a_mask_that_leaves_too_little():
    projection = cylinder((240, 320), CAMERA.focal)
    almost_all = np.zeros((240, 320), np.float32)
    almost_all[100:120, 150:170] = 1.0
    with pytest.raises(FrameError, match='covers too much'):
        YawMeter(projection, mask=almost_all)


def test_reset_starts_anew():
    _, frames = rendered()
    meter = YawMeter(cylinder(frames[0].shape, CAMERA.focal))
    for frame in frames[:15]:
        meter.update(frame, 0.1)
    meter.reset()
    # All that is kept is the tilt.
    other = YawMeter(cylinder(frames[0].shape, CAMERA.focal), mounting=deepcopy(meter.mounting),
                     roll=deepcopy(meter.roll))
    again = [meter.update(frame, 0.1) for frame in frames[:15]]
    assert again == [other.update(frame, 0.1) for frame in frames[:15]]


@pytest.mark.parametrize(('clip', 'focal_px', 'expected', 'mirrored'), [
    ('00', 718.856, 1, False), ('06', 707.091, 0, True)])
def test_kitti(kitti_root, clip, focal_px, expected, mirrored):
    frames = grey_pictures(kitti_root / clip)
    truth = np.degrees(poses_from_kitti(np.loadtxt(kitti_root / clip / 'poses.txt'))[:, 2])
    truth -= truth[0]
    stamps = np.rint(np.loadtxt(kitti_root / clip / 'times.txt') * 1e9).astype(int).tolist()
    if mirrored:
        frames = [np.ascontiguousarray(frame[:, ::-1]) for frame in frames]
        truth = -truth
    headings, tracker, code, turns = follow(frames, stamps, focal_px)
    error = headings - truth
    assert np.abs(error).max() < 2.5
    assert abs(error[-1]) < 1.0
    # KLT tracks of 1000 corners and an essential matrix: 0.065 and 0.077 degrees.
    assert np.sqrt(np.mean(np.diff(error) ** 2)) < 0.07
    assert tracker.bridged == 0
    assert len(turns) == len(changes(code)) == expected


@pytest.mark.parametrize('times', [1, 2, 4])
def test_the_yaw_errs_by_what_it_says_in_a_coarser_picture_too(times):
    drive, frames = rendered()
    reduced = [
        cv2.resize(frame, None, fx=1 / times, fy=1 / times, interpolation=cv2.INTER_AREA)
        for frame in frames]
    meter = YawMeter(cylinder(reduced[0].shape, CAMERA.focal / times))
    meter.update(reduced[0], 0.1)
    found = [meter.update(frame, 0.1) for frame in reduced[1:]]
    errors = [each.yaw for each in found] - np.diff(drive.poses[:, 2])
    assert 0.4 < np.mean(errors ** 2 / [each.variance for each in found]) < 2.0


def test_a_mask_can_change_in_mid_drive_and_no_pair_is_lost():
    """Two text boxes are fixed; from the turn on, they are masked."""
    _, frames = rendered()
    mask = np.ones(frames[0].shape, np.float32)
    mask[40:200, 30:110] = mask[40:200, 210:290] = 0.0
    box = np.random.default_rng(4).integers(0, 255, frames[0].shape)
    spoilt = [np.where(mask > 0, frame, box).astype(np.uint8) for frame in frames[14:24]]
    projection = cylinder(frames[0].shape, CAMERA.focal)
    changing, masked, never = (
        YawMeter(projection), YawMeter(projection, mask=mask), YawMeter(projection))
    for number, frame in enumerate(spoilt):
        if number == 5:
            seen = changing.correlation_map()
            changing.use_mask(mask)
            # The map of the newest pair is still there to be shown.
            assert np.array_equal(changing.correlation_map(), seen)
        found, expected, spoilt_one = (
            meter.update(frame, 0.1) for meter in (changing, masked, never))
        if number >= 5:
            assert found.shift.dx == pytest.approx(expected.shift.dx, abs=0.3)
            assert found.yaw == pytest.approx(expected.yaw, abs=0.015) and found.motion is not None
            assert found.agreement > spoilt_one.agreement
            assert spoilt_one.yaw is None or (
                abs(found.yaw - expected.yaw) < abs(spoilt_one.yaw - expected.yaw))
    changing.use_mask(None)
    again = changing.update(frames[24], 0.1)
    assert again.yaw is not None


def test_a_mask_that_leaves_too_little_is_not_used():
    drive, frames = rendered()
    meter = YawMeter(cylinder(frames[0].shape, CAMERA.focal))
    meter.update(frames[14], 0.1)
    meter.use_mask(np.zeros(frames[0].shape, np.float32))
    expected = drive.poses[15, 2] - drive.poses[14, 2]
    assert meter.update(frames[15], 0.1).yaw == pytest.approx(expected, abs=0.01)
