# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames of any kind: what is refused, and what does not matter to the result."""

import numpy as np
from phase_traj_ros.core import (
    CameraModel,
    CodeSource,
    EstimatorSettings,
    Lens,
    TrajectoryEstimator,
)
from phase_traj_ros.core.frames.prepare import prepare
from phase_traj_ros.errors import FrameError
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
import pytest

CAMERA = Camera.with_field_of_view(320, 240, 70.0)
MODEL = CameraModel(
    width=320, height=240, fx=CAMERA.focal, fy=CAMERA.focal, cx=CAMERA.cx, cy=CAMERA.cy)
AUTO = EstimatorSettings(
    code_source=CodeSource.AUTO, lens=Lens(camera=MODEL), camera_height=1.65)


@pytest.fixture(scope='module')
def drive():
    made = plan_drive(
        'corner', [Straight(0.6), Turn(60, 2.0, 4.0), Straight(0.4)], camera=CAMERA, seed=3)
    return made.stamps_ns.tolist(), list(render_drive(made)), made.poses


def fed(drive, settings=AUTO, changed=lambda frame: frame):
    estimator = TrajectoryEstimator(settings)
    stamps, frames, _ = drive
    for stamp, frame in zip(stamps, frames):
        estimator.update(changed(frame), stamp)
    return estimator


def result(estimator):
    return estimator.heading.tracker.heading, estimator.way.distance


@pytest.mark.parametrize('settings', [AUTO, EstimatorSettings(), EstimatorSettings(
    code_source=CodeSource.AUTO)], ids=['given', 'paper', 'learned'])
@pytest.mark.parametrize('spoil', [
    lambda frame: frame.astype(np.int32), lambda frame: frame > 128,
    lambda frame: frame.astype(np.float16), lambda frame: frame.astype(np.float64),
    lambda frame: np.dstack([frame] * 3), lambda frame: frame[:4, :4],
    lambda frame: np.where(np.arange(frame.size).reshape(frame.shape) == frame.size - 1,
                           np.float32(np.nan), frame.astype(np.float32)),
    lambda frame: np.where(np.arange(frame.size).reshape(frame.shape) == 0,
                           np.float32(np.inf), frame.astype(np.float32)),
], ids=['int32', 'bool', 'float16', 'float64', 'colours', 'tiny', 'nan_below', 'infinity'])
def test_a_frame_that_cannot_be_used_is_as_if_it_had_never_come(drive, settings, spoil):
    stamps, frames, _ = drive
    clean, other = TrajectoryEstimator(settings), TrajectoryEstimator(settings)
    for index in range(5):
        expected = clean.update(frames[index], stamps[index])
        if index > 0:
            with pytest.raises(FrameError):
                other.update(spoil(frames[index]), stamps[index] - 1)
        update = other.update(frames[index], stamps[index])
        assert (update and (update.status, update.shift, update.heading, update.travel)) == (
            expected and (expected.status, expected.shift, expected.heading, expected.travel))
    assert other.counters == clean.counters


@pytest.mark.parametrize('settings', [AUTO, EstimatorSettings(code_source=CodeSource.AUTO)],
                         ids=['given', 'learned'])
def test_the_buffer_of_a_frame_may_be_used_again(drive, settings):
    buffer = np.empty_like(drive[1][0])

    def reused(frame):
        buffer[...] = frame
        return buffer

    assert result(fed(drive, settings, reused)) == result(fed(drive, settings))


@pytest.mark.parametrize('change', [
    lambda frame: (20000 + 12 * frame.astype(np.uint16)).astype(np.uint16),
    lambda frame: (40 * frame.astype(np.uint16)).astype(np.uint16),
    lambda frame: (frame.astype(np.float32) - 128.0) / 128.0,
    lambda frame: 1e-4 * frame.astype(np.float32) - 5.0,
], ids=['thermal', '16_bits', 'around_zero', 'below_zero'])
def test_neither_gain_nor_offset_change_the_result(drive, change):
    heading, _ = result(fed(drive))
    changed = fed(drive, changed=change)
    true = np.hypot(*np.diff(drive[2][:, :2], axis=0).T).sum()
    assert changed.heading.tracker.bridged == 0
    assert np.degrees(changed.heading.tracker.heading) == pytest.approx(
        np.degrees(heading), abs=0.4)
    assert changed.way.distance == pytest.approx(true, rel=0.03)


def test_a_constant_frame_has_no_contrast_to_set():
    assert np.ptp(prepare(np.full((16, 16), 7.5, np.float32))) == 0


def test_a_focal_length_in_pixels_is_for_frames_of_one_size(drive):
    stamps, frames, _ = drive
    half = np.ascontiguousarray(frames[1][::2, ::2])
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, lens=Lens(focal_px=CAMERA.focal)))
    estimator.update(frames[0], stamps[0])
    with pytest.raises(FrameError, match='160x120 pixels after frames of 320x240'):
        estimator.update(half, stamps[1])
    assert estimator.update(frames[1], stamps[1]).heading.yaw is not None
    estimator.use_lens(Lens(focal_px=CAMERA.focal / 2))
    estimator.update(half, stamps[2])
    assert estimator.heading.camera.focal_px == CAMERA.focal / 2


@pytest.mark.parametrize('name', ['max_speeds', 'max_corners'])
def test_nothing_can_be_kept_of_no_speeds_and_no_corners(name):
    with pytest.raises(ValueError, match=f'{name} is 0: give at least 1, or None to keep all'):
        EstimatorSettings(**{name: 0})


def test_only_a_frame_that_may_change_is_copied():
    frame = np.random.default_rng(2).integers(0, 256, (40, 60), np.uint8)
    copied = prepare(frame)
    frame[:] = 0
    assert copied.any()
    copied.flags.writeable = False
    assert prepare(copied) is copied
