# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""At a high frame rate, frames are foreseen between measured ones: what they cost and say."""

from functools import cache
from itertools import pairwise
import math

import cv2
import numpy as np
from phase_traj_ros.core import (
    CameraModel,
    CodeSource,
    EstimatorSettings,
    Lens,
    PairStatus,
    TrajectoryEstimator,
)
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.correlation import transforms
from phase_traj_ros.core.reliability.reason import Reason
from phase_traj_ros.core.rotation.scanline import Scanline
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
import pytest

CAMERA = Camera.with_field_of_view(480, 270, 80.0)
MODEL = CameraModel(
    width=480, height=270, fx=CAMERA.focal, fy=CAMERA.focal, cx=CAMERA.cx, cy=CAMERA.cy)
SPEED = 6.0


@cache
def corner():
    """Return a drive round a corner at 60 frames per second, with the noise of a sensor."""
    drive = plan_drive('corner', [Straight(0.5), Turn(70, 2.0, 4.0), Straight(0.5)],
                       rate_hz=60.0, speed=SPEED, camera=CAMERA, seed=5)
    rng = np.random.default_rng(0)
    return drive, [
        np.clip(frame + rng.normal(0.0, 1.0, frame.shape).round(), 0, 255).astype(np.uint8)
        for frame in render_drive(drive)]


def estimating(**values):
    return TrajectoryEstimator(EstimatorSettings(
        **{'code_source': CodeSource.AUTO, 'lens': Lens(camera=MODEL), 'camera_height': 1.65,
           **values}))


def run(*, every=1, **values):
    """Return an estimator that has driven round the corner, and its updates."""
    drive, frames = corner()
    estimator = estimating(**values)
    updates = [
        estimator.update(frame, stamp) for frame, stamp in
        zip(frames[::every], drive.stamps_ns.tolist()[::every])]
    return estimator, [update for update in updates if update is not None]


# For tests that only look at what came of it.
driven = cache(run)


def counted(monkeypatch, **values):
    """Return the Fourier transforms and searches for blocks of a drive, per frame."""
    calls = {'transforms': 0, 'searches': 0}
    forward, search = transforms.find_transform().__class__.forward, cv2.calcOpticalFlowPyrLK

    def counting_forward(*those):
        calls['transforms'] += 1
        return forward(*those)

    def counting_search(*those, **named):
        calls['searches'] += 1
        return search(*those, **named)

    with monkeypatch.context() as patch:
        patch.setattr(transforms.find_transform().__class__, 'forward', counting_forward)
        patch.setattr(cv2, 'calcOpticalFlowPyrLK', counting_search)
        _, updates = run(**values)
    return {kind: count / (len(updates) + 1) for kind, count in calls.items()}


def test_most_frames_at_60_hz_need_neither_transform_nor_search(monkeypatch):
    often, seldom = counted(monkeypatch), counted(monkeypatch, every=6)
    assert often['searches'] < 0.5 * seldom['searches']
    assert often['transforms'] < 0.5 * seldom['transforms']


def test_every_frame_is_measured_at_10_hz(monkeypatch):
    calls = counted(monkeypatch, every=6)
    assert calls['searches'] >= 0.9 and calls['transforms'] >= 3.0


def heading_errors(updates, every=1):
    drive, _ = corner()
    true = np.unwrap(drive.poses[::every, 2])[1:] - drive.poses[0, 2]
    return np.array([update.heading.heading for update in updates]) - true


@pytest.mark.parametrize('source', [CodeSource.AUTO, CodeSource.HEADING])
def test_every_frame_has_a_heading_at_60_hz_and_at_10(source):
    _, updates = driven(code_source=source)
    _, seldom = driven(every=6, code_source=source)
    assert len(updates) == len(corner()[0]) - 1
    # Each within 2 % of the corner: which of them is closer changes from corner to corner.
    for errors in heading_errors(updates), heading_errors(seldom, 6):
        assert np.degrees(np.abs(errors).max()) < 0.02 * 70


def test_what_is_foreseen_is_within_its_variance():
    _, updates = driven()
    errors = heading_errors(updates)
    said = np.array([update.heading.foreseen for update in updates])
    measured = np.maximum.accumulate(np.where(said == 0.0, np.arange(len(said)), -1))
    off = (errors - errors[measured])[(said > 0.0) & (measured >= 0)]
    said = said[(said > 0.0) & (measured >= 0)]
    assert np.mean(np.abs(off) < 2.0 * said) > 0.9
    # Nor is it far more than the error.
    assert np.sqrt(np.mean(off ** 2)) > 0.2 * np.mean(said)
    deviation = np.sqrt([update.odometry.covariance[2][2] for update in updates])
    foreseen = np.array([update.heading.foreseen > 0.0 for update in updates])
    assert (np.diff(deviation)[foreseen[1:] & ~foreseen[:-1]] > 0.0).all()


def test_a_foreseen_shift_is_that_of_the_yaw_with_the_newest_response():
    _, updates = driven()
    for newest, update in pairwise(updates):
        if update.heading.foreseen > 0.0 and newest.heading.foreseen == 0.0:
            turned = math.tan(update.heading.yaw)
            assert update.shift.dx == pytest.approx(CAMERA.focal * turned, rel=0.01, abs=1e-6)
            assert (update.shift.dy, update.shift.response) == (0.0, newest.shift.response)


def test_the_parts_add_up():
    drive, _ = corner()
    estimator, updates = driven()
    assert len(estimator.codes.movement) == len(drive) - 1
    lasted = drive.stamps_ns[-1] - drive.stamps_ns[0]
    assert sum(update.interval_ns for update in updates) == lasted
    assert sum(update.heading.yaw for update in updates) == pytest.approx(
        updates[-1].heading.heading)
    assert sum(update.travel.distance for update in updates) == pytest.approx(
        estimator.way.distance)
    assert estimator.way.pairs == len(updates)
    assert min(update.heading.variance for update in updates) > 0.0
    assert min(update.travel.variance for update in updates) > 0.0
    apart = np.diff([(update.odometry.pose.x, update.odometry.pose.y) for update in updates],
                    axis=0)
    assert np.hypot(*apart.T).sum() == pytest.approx(estimator.way.distance, rel=0.02)
    assert estimator.path.tip == updates[-1].tip


def test_a_correction_is_not_published_as_motion():
    drive, _ = corner()
    _, updates = driven()
    rates = np.gradient(np.unwrap(drive.poses[:, 2]), 1 / 60)[1:]
    found = np.array([update.odometry.yaw_rate for update in updates])
    assert np.degrees(np.abs(found - rates)[6:]).max() < 12.0
    speeds = np.array([update.speed for update in updates[60:]])
    true = np.hypot(*np.diff(drive.poses[60:, :2], axis=0).T) * 60
    assert np.abs(speeds - true).max() < 0.25 * SPEED


def test_a_repeated_picture_keeps_the_foreseen_heading():
    drive, frames = corner()
    estimator = estimating()
    for frame, stamp in zip(frames[:72], drive.stamps_ns.tolist()):
        before = estimator.update(frame, stamp)
        again = estimator.update(frame, stamp + 5_000_000)
        assert again is None or again.status is PairStatus.REPEATED
        if before is not None:
            assert again.heading.heading == before.heading.heading


def test_a_camera_that_stops_stamping_is_frozen_after_a_second():
    drive, frames = corner()
    estimator = estimating()
    for frame, stamp in zip(frames[:80], drive.stamps_ns.tolist()):
        estimator.update(frame, stamp)
    estimator.repeat_stamp(54)
    assert Reason.FROZEN not in estimator.reliability.reasons
    estimator.repeat_stamp(10)
    assert Reason.FROZEN in estimator.reliability.reasons


def test_the_counters_count_foreseen_frames():
    drive, frames = corner()
    rng = np.random.default_rng(3)
    noisy = (frames[0] + rng.normal(0.0, 2.0, (60, *frames[0].shape)).round()).clip(0, 255)
    estimator = estimating()
    updates = [estimator.update(frame, stamp) for frame, stamp in zip(
        noisy.astype(np.uint8), drive.stamps_ns.tolist())][1:]
    still = [update for update in updates if update.status is PairStatus.STILL]
    assert any(update.heading.foreseen > 0.0 for update in still)
    assert estimator.counters.still == len(still)


def test_a_turn_has_the_numbers_of_its_frames():
    drive, _ = corner()
    estimator, _ = run()
    turn, = [*estimator.turns, *estimator.heading.finish()]
    for frame, stamp_ns in ((turn.start_frame, turn.start_ns), (turn.end_frame, turn.end_ns)):
        assert drive.stamps_ns[frame] == stamp_ns


def test_a_jump_to_the_side_is_measured_at_once():
    """After frames of steady driving, one is turned by a degree at once."""
    drive, frames = corner()
    for at in range(30, 36):
        estimator = estimating()
        for frame, stamp in zip(frames[:at], drive.stamps_ns.tolist()):
            before = estimator.update(frame, stamp)
        moved = np.roll(frames[at], round(CAMERA.focal * math.radians(1.0)), axis=1)
        update = estimator.update(moved, int(drive.stamps_ns[at]))
        assert update.heading.foreseen == 0.0
        turned = math.degrees(update.heading.heading - before.heading.heading)
        assert turned == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize('other', ['black', 'noise', 'mirrored'])
def test_a_picture_of_something_else_is_measured_at_once(other):
    drive, frames = corner()
    estimator = estimating()
    strange = {
        'black': np.zeros_like(frames[0]), 'mirrored': np.ascontiguousarray(frames[-1][:, ::-1]),
        'noise': np.random.default_rng(1).integers(0, 256, frames[0].shape, np.uint8)}[other]
    for frame, stamp in zip([*frames[:40], strange], drive.stamps_ns.tolist()):
        update = estimator.update(frame, stamp)
    assert update.status is PairStatus.NO_MEASUREMENT
    after = estimator.update(frames[41], int(drive.stamps_ns[41]))
    assert after.heading.foreseen == 0.0


def test_another_lens_and_a_gap_end_what_is_foreseen():
    drive, frames = corner()
    stamps = drive.stamps_ns.tolist()
    estimator = estimating(max_gap=0.02)
    for frame, stamp in zip(frames[:40], stamps):
        estimator.update(frame, stamp)
    late = estimator.update(frames[42], stamps[42])
    assert late.status is PairStatus.GAP
    # The frames in between were not lost.
    assert [update.status for update in driven(max_gap=0.02)[1]].count(PairStatus.GAP) == 0
    estimator.use_lens(Lens(hfov_deg=70.0))
    assert estimator.update(frames[43], stamps[43]).status is PairStatus.REPRIMED


def test_a_scanline_tells_a_shift_from_driving_ahead():
    projection = CylinderProjection(MODEL)
    _, frames = corner()
    line = Scanline(projection, frames[0])
    wide = cv2.warpAffine(
        frames[0], np.array([[1.02, 0.0, -0.02 * CAMERA.cx], [0.0, 1.0, 0.0]]),
        (CAMERA.width, CAMERA.height), borderMode=cv2.BORDER_REPLICATE)
    assert abs(line.shift_error(wide, 0.0)) < 0.2
    turned = np.roll(frames[0], 2, axis=1)
    scale = projection.px_per_rad / CAMERA.focal
    assert line.shift_error(turned, 0.0) == pytest.approx(2 * scale, abs=0.4)
    assert line.shift_error(turned, 2 * scale) == pytest.approx(0.0, abs=0.3)
    assert line.shift_error(np.zeros_like(frames[0]), 0.0) is None


def test_the_variance_of_a_rate_holds_for_frames_that_are_foreseen():
    drive, _ = corner()
    _, updates = driven()
    yaw, times = np.unwrap(drive.poses[:, 2]), drive.stamps_ns * 1e-9
    errors, last = [], 0
    for update in updates:
        # The rate of a foreseen frame is that since the newest one that was measured.
        now = update.pair + 1
        true = (yaw[now] - yaw[last]) / (times[now] - times[last])
        if update.heading.foreseen > 0.0:
            errors.append((update.odometry.yaw_rate - true) / math.sqrt(
                update.odometry.yaw_rate_variance))
        else:
            last = now
    assert len(errors) > 50
    assert 0.1 < np.mean(np.square(errors)) < 2.0
    assert np.max(np.abs(errors)) < 5.0
