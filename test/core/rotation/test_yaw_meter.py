# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Yaw, heading and turns from pictures: rendered drives whose truth is known, and KITTI."""

from dataclasses import replace
from functools import cache
import math

import cv2
import numpy as np
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.codes.from_heading import HeadingCode
from phase_traj_ros.core.correlation.phase_correlation import Shift
from phase_traj_ros.core.heading.tracker import HeadingTracker
from phase_traj_ros.core.heading.turns import find_turns
from phase_traj_ros.core.rotation import yaw_meter
from phase_traj_ros.core.rotation.scanline import Scanline
from phase_traj_ros.core.rotation.tuning import TUNING
from phase_traj_ros.core.rotation.whole_shift import WholeShift
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement, YawMeter
from phase_traj_ros.errors import FrameError
from phase_traj_ros.synthetic import (
    Camera,
    plan_drive,
    poses_from_kitti,
    render_drive,
    Straight,
    Turn,
)
from phase_traj_ros.synthetic.degradations import rain
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


def follow(frames, stamps_ns, focal_px, **options):
    """Return the headings in degrees, the tracker, the code and the turns of a drive."""
    meter = YawMeter(cylinder(frames[0].shape, focal_px), **options)
    tracker, code, headings = HeadingTracker(), HeadingCode(), [0.0]
    meter.update(frames[0], 0.1)
    for frame, interval_ns in zip(frames[1:], np.diff(stamps_ns).tolist()):
        interval = interval_ns / 1e9
        measured = meter.update(frame, interval)
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


def test_frames_of_a_camera_that_is_upside_down():
    drive, frames = rendered()
    meter = YawMeter(cylinder(frames[0].shape, CAMERA.focal, rotate_180=True))
    yaws = [
        meter.update(np.ascontiguousarray(frame[::-1, ::-1]), 0.1) for frame in frames[:40]]
    assert yaws[0] is None
    assert sum(each.yaw for each in yaws[1:]) == pytest.approx(
        drive.poses[39, 2], abs=math.radians(1.0))


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


@pytest.mark.parametrize('seed', [2, 3])
def test_rain_in_a_corner_does_not_turn_the_direction_of_travel(seed):
    """If it did, the yaw would follow it, by the more the longer the corner lasts."""
    drive, frames = rendered()
    wet = [rain(frame, streaks=1000, seed=(seed, number)) for number, frame in enumerate(frames)]
    headings, _, _, turns = follow(wet, drive.stamps_ns.tolist(), CAMERA.focal)
    assert np.abs(headings - np.degrees(drive.poses[:, 2])).max() < 8.0
    assert [turn.quarter_turns for turn in turns] == [1, -1]


def test_nothing_to_see_is_no_measurement():
    _, frames = rendered()
    meter = YawMeter(cylinder(frames[0].shape, CAMERA.focal))
    dark = np.zeros_like(frames[0])
    assert meter.update(dark, 0.1) is None
    assert meter.update(dark, 0.1).yaw is None
    noise = np.random.default_rng(0).integers(0, 255, (2, *dark.shape)).astype(np.uint8)
    meter.update(noise[0], 0.1)
    unrelated = meter.update(noise[1], 0.1)
    assert unrelated.yaw is None and not unrelated.refined


def test_a_still_picture_is_no_yaw():
    _, frames = rendered()
    meter = YawMeter(cylinder(frames[0].shape, CAMERA.focal))
    meter.update(frames[5], 0.1)
    measured = meter.update(frames[5], 0.1)
    assert measured.yaw == pytest.approx(0.0, abs=1e-6)
    assert measured.agreement == 1.0 and measured.refined


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


def test_refuses_frames_and_masks_that_do_not_fit():
    projection = cylinder((240, 320), CAMERA.focal)
    with pytest.raises(FrameError, match='give grey frames'):
        YawMeter(projection).update(np.zeros((240, 322), np.uint8), 0.1)
    with pytest.raises(FrameError, match='give grey frames'):
        YawMeter(projection, mask=np.ones((10, 10), np.float32))
    almost_all = np.zeros((240, 320), np.float32)
    almost_all[100:120, 150:170] = 1.0
    with pytest.raises(FrameError, match='covers too much'):
        YawMeter(projection, mask=almost_all)


def test_reset_starts_anew():
    _, frames = rendered()
    meter = YawMeter(cylinder(frames[0].shape, CAMERA.focal))
    first = [meter.update(frame, 0.1) for frame in frames[:15]]
    meter.reset()
    assert [meter.update(frame, 0.1) for frame in frames[:15]] == first


@pytest.mark.parametrize('mirrored', [False, True])
@pytest.mark.parametrize(
    ('clip', 'focal_px', 'expected'), [('00', 718.856, 1), ('06', 707.091, 0)])
def test_kitti(kitti_root, clip, focal_px, expected, mirrored):
    files = sorted((kitti_root / clip / 'image_0').glob('*.png'))
    frames = [cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) for file in files]
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


FAR = cv2.GaussianBlur(
    np.random.default_rng(0).normal(size=(240, 900)).astype(np.float32), (0, 0), 1.5)
FAR = np.clip(128 + 50 * FAR / FAR.std(), 0, 255).astype(np.uint8)
LONG_FOCAL = 800.0


def far(moved):
    """Return what a camera with a long lens sees of a far scene, moved to the right by pixels."""
    return np.ascontiguousarray(FAR[:, 300 - moved:620 - moved])


def meter_of_far(**options):
    return YawMeter(cylinder((240, 320), LONG_FOCAL), **options)


def test_a_pair_has_the_share_of_its_time_since_the_keyframe():
    for keyframes, expected in ((True, [1, 1 / 2, 1 / 3, 1 / 4]), (False, [1] * 4)):
        meter = meter_of_far(keyframes=keyframes)
        meter.update(far(0), 0.1)
        shares = [meter.update(far(0), 0.1).share for _ in range(10)]
        assert shares[:4] == pytest.approx(expected)
        # After half a second, there is another one.
        assert min(shares) >= 1 / 6 and shares.count(1.0) > 1


@pytest.mark.parametrize('step', [-10, 10])
def test_a_steady_turn_needs_one_search_for_the_blocks(step, monkeypatch):
    searches, search = [], cv2.calcOpticalFlowPyrLK
    monkeypatch.setattr(
        cv2, 'calcOpticalFlowPyrLK', lambda *those, **named: searches.append(1) or search(
            *those, **named))
    meter = meter_of_far()
    found = [meter.update(far(step * count), 0.1) for count in range(10)][1:]
    # It was not foreseen in the first pair.
    assert len(searches) == len(found) + 1
    assert [each.yaw * LONG_FOCAL for each in found] == pytest.approx([step] * 9, abs=0.15)


@pytest.mark.parametrize('light', [0.5, 1.6])
def test_a_sudden_change_of_the_exposure_moves_nothing(light):
    meter = meter_of_far()
    meter.update(far(0) // 2, 0.1)
    found = meter.update(cv2.convertScaleAbs(far(0) // 2, alpha=light), 0.1)
    assert found.refined and found.agreement > 0.9
    assert found.yaw == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize('step', [-2, 2])
def test_what_stays_while_the_camera_turns_is_fixed_to_it(step):
    """Above the road, too, where far parts of a scene may rest while the vehicle drives ahead."""
    meter = meter_of_far()
    for count in range(12):
        frame = far(step * count)
        frame[5:115, 60:240] = far(0)[5:115, 60:240]
        meter.update(frame, 0.1)
    x, y = meter._grid.middles.T
    fixed = meter._grid.fixed
    assert fixed[(y < 105) & (x > 70) & (x < 220)].mean() > 0.9
    assert not fixed[(y > 125) | (x < 50) | (x > 250)].any()


def test_a_line_tells_to_which_side_the_image_has_moved_farther_than_foreseen():
    line = Scanline(cylinder((240, 320), LONG_FOCAL), far(0))
    for moved, foreseen in ((6, 4.0), (2, 4.0), (-5, -3.0), (3, 3.0)):
        assert line.moved_aside(far(moved), foreseen) == pytest.approx(moved - foreseen, abs=0.3)


def test_a_frame_is_foreseen_while_the_image_moves_as_before():
    meter = meter_of_far()
    assert not meter.foresees(far(0), 0.02, 0.02)
    for count in range(4):
        meter.update(far(4 * count), 0.04)
    # Half a period later, it has moved by half as much; in another light, too.
    assert meter.foresees(far(14), 0.02, 0.02)
    assert meter.foresees(far(14) // 2 + 60, 0.02, 0.02)
    for wrong in (far(12), far(16), far(100), np.ascontiguousarray(far(14)[:, ::-1])):
        assert not meter.foresees(wrong, 0.02, 0.02)
    # The next one would come too late.
    assert not meter.foresees(far(14), 0.02, 0.2)


def test_a_yaw_by_the_shift_alone_is_unsure_by_tenths_of_a_degree():
    whole = YawMeasurement(Shift(1.0, 0.0, 0.1), 0.01, False, 0.1)
    assert 0.1 < math.degrees(math.sqrt(whole.variance)) < 1.0
    part = YawMeasurement(Shift(1.0, 0.0, 0.1), 0.01, True, 0.8, share=0.25)
    assert part.variance == pytest.approx(whole.variance / 4)
    assert part.certain and not whole.certain


def hidden(moved, share, number):
    """Return the far scene with a share of its columns hidden by noise, of its own per frame."""
    frame = far(moved)
    columns = round(share * frame.shape[1])
    noise = cv2.GaussianBlur(
        np.random.default_rng(number).normal(size=(240, columns)).astype(np.float32), (0, 0), 1.5)
    frame[:, :columns] = np.clip(128 + 50 * noise / noise.std(), 0, 255)
    return frame


@pytest.mark.parametrize('stands_out', [True, False])
def test_few_blocks_count_if_the_whole_shift_confirms_them(stands_out, monkeypatch):
    monkeypatch.setattr(
        WholeShift, 'significance', lambda *_: 1.1 * stands_out * TUNING.least_significance)
    meter = meter_of_far()
    meter.update(hidden(0, 0.7, 0), 0.1)
    found = meter.update(hidden(12, 0.7, 1), 0.1)
    assert TUNING.confirmed_share <= found.agreement < TUNING.least_agreement
    assert found.shift.dx == pytest.approx(12, abs=1.0)
    assert found.refined is stands_out and not found.certain
    right = pytest.approx(12 / LONG_FOCAL, abs=0.3 / LONG_FOCAL)
    assert found.yaw == (right if stands_out else None)


def test_few_blocks_that_contradict_the_whole_shift_are_no_measurement(monkeypatch):
    monkeypatch.setattr(WholeShift, 'update', lambda whole, picture: Shift(60.0, 0.0, 0.2))
    monkeypatch.setattr(WholeShift, 'significance', lambda whole, shift: 20.0)
    for share, told in ((0.7, False), (0.9, True)):
        meter = meter_of_far()
        meter.update(hidden(0, share, 0), 0.1)
        meter._rate = 12 / LONG_FOCAL / 0.1
        found = meter.update(hidden(12, share, 1), 0.1)
        assert not found.refined
        # Where the blocks tell nothing, the shift alone counts.
        assert (found.yaw is not None) is told


def test_a_few_blocks_count_for_nothing_however_well_they_agree(monkeypatch):
    monkeypatch.setattr(WholeShift, 'significance', lambda *_: 20.0)
    meter = meter_of_far()
    meter.update(far(0), 0.1)
    many = meter.update(far(3), 0.1)
    assert many.certain
    for factor, refined in ((0.99, True), (1.5, False)):
        monkeypatch.setattr(yaw_meter, 'TUNING', replace(
            TUNING, least_blocks=factor * many.motion.agreeing))
        meter.reset()
        meter.update(far(0), 0.1)
        found = meter.update(far(3), 0.1)
        assert found.agreement == many.agreement
        assert (found.refined, found.certain) == (refined, refined)
        # The shift alone counts.
        assert found.yaw == pytest.approx(3 / LONG_FOCAL, abs=0.5 / LONG_FOCAL)


def test_the_fewer_blocks_agree_the_less_certain_is_the_yaw():
    meter = meter_of_far()
    meter.update(far(0), 0.1)
    motion = meter.update(far(3), 0.1).motion
    whole, half, fifth = (
        YawMeasurement(Shift(3.0, 0.0, 0.1), motion.yaw, True, share, motion).variance
        for share in (1.0, 0.5, 0.2))
    assert whole == half == pytest.approx(motion.yaw_variance)
    assert fifth == pytest.approx(2.5 ** 2 * half)


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


@pytest.mark.parametrize('focal_px', [LONG_FOCAL, 12.0 * LONG_FOCAL])
def test_no_lens_is_so_long_that_the_yaw_is_sure_to_less_than_a_hundredth_of_a_degree(focal_px):
    meter = YawMeter(cylinder((240, 320), focal_px), keyframes=False)
    meter.update(far(0), 0.1)
    found = meter.update(far(1), 0.1)
    assert found.refined
    assert math.sqrt(found.variance) > math.radians(0.01)


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
            assert found.yaw == pytest.approx(expected.yaw, abs=0.015) and found.refined
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
