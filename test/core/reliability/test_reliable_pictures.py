# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which rendered pictures give a reliable result."""

import math

import cv2
import numpy as np
import overlays
from phase_traj_ros.core import (
    CodeSource,
    EstimatorSettings,
    GateSettings,
    Lens,
    TrajectoryEstimator,
)
from phase_traj_ros.core.reliability.reason import Reason
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
from phase_traj_ros.synthetic.degradations import night, rain, sensor_noise
import pytest

FOCAL = 160 / math.tan(math.radians(35))
SECOND = 1_000_000_000


@pytest.fixture(scope='module')
def drive():
    plan = [Straight(1.0), Turn(-90.0, 3.0, 4.5), Straight(1.0)]
    return list(render_drive(plan_drive(
        'a drive', plan, rate_hz=10.0, camera=Camera.with_field_of_view(320, 240, 70), speed=6.0,
        seed=8)))


def followed(frames, interval=0.1):
    """Return the verdict on frames."""
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, lens=Lens(focal_px=FOCAL), gate=GateSettings()))
    for number, frame in enumerate(frames):
        estimator.update(frame, round(number * interval * SECOND))
    return estimator.reliability.reasons


@pytest.mark.parametrize(('spoil', 'every'), [
    (lambda frame, number: frame, 3),
    (lambda frame, number: sensor_noise(frame, sigma=20.0, seed=number), 3),
    (lambda frame, number: night(frame, seed=number), 3),
    (lambda frame, number: rain(frame, streaks=300, seed=number), 1),
    (lambda frame, number: overlays.drops(frame), 3),
    (lambda frame, number: overlays.black_bars(frame, sides=0.2), 3)])
def test_usable_pictures_give_a_reliable_result(drive, spoil, every):
    frames = [spoil(frame, number) for number, frame in enumerate(drive[::every])]
    assert followed(frames, 0.1 * every) == ()


@pytest.mark.parametrize(('spoil', 'reasons'), [
    (lambda frame, number: overlays.burnt_in_text(
        night(frame, exposure=0.0005, seed=number), '2026-03-01 12:34'),
     (Reason.NOTHING_TO_SEE,)),
    # The drops cover the road, too.
    (lambda frame, number: overlays.drops(frame, count=400, size=0.025, seed=2),
     (Reason.VIEW_BLOCKED, Reason.ROAD_UNCLEAR))])
def test_a_night_without_light_and_a_lens_full_of_drops_do_not(drive, spoil, reasons):
    assert followed(spoil(frame, number) for number, frame in enumerate(drive)) == reasons


def test_a_hand_held_camera_in_a_crowd_does_not(drive):
    """About fifteen people walk across at 2 Hz, each in another direction; the hand shakes."""
    rng, shaking = np.random.default_rng(6), 2.0
    coats = [np.clip(128 + 4 * (cv2.GaussianBlur(
        rng.integers(0, 255, (160, 50)).astype(np.uint8), (0, 0), 2) - 128.0), 0, 255)
        for _ in range(15)]
    start, pace = rng.uniform(0, 320, 15), rng.normal(0, 30, 15)

    def crowded(number, frame):
        for coat, first, walked in zip(coats, start, pace):
            left = int(first + walked * number + rng.normal(0, 4)) % 270
            top = min(int(70 + rng.normal(0, 4)), 80)
            frame = frame.copy()
            frame[top:top + 160, left:left + 50] = coat
        turn = cv2.getRotationMatrix2D((160, 120), rng.normal(0, shaking), 1.1)
        turn[:, 2] += rng.normal(0, shaking * FOCAL / 57.3, 2)
        return cv2.warpAffine(frame, turn, (320, 240), borderMode=cv2.BORDER_REFLECT)

    frames = [crowded(number, frame) for number, frame in enumerate(drive)]
    assert set(followed(frames, 0.5)) >= {Reason.NOT_ONE_MOTION, Reason.RATE_TOO_LOW}
