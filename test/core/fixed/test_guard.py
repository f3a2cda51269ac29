# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a guard leaves out of the frames."""

import cv2
import numpy as np
import overlays
from phase_traj_ros.core.correlation.phase_correlation import Shift
from phase_traj_ros.core.correlation.quality import Quality
from phase_traj_ros.core.fixed.guard import FixedGuard
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Turn
import pytest


@pytest.fixture(scope='module')
def turning():
    return list(render_drive(plan_drive(
        '', [Turn(-200.0, 7.0)], camera=Camera.with_field_of_view(320, 240, 70), speed=4.5,
        seed=4)))


def shares(guard, frames):
    """Return the share of the picture that is left out after each frame, if that has changed."""
    left_out = []
    yaw = YawMeasurement(Shift(20.0, 0.0, 0.3), -0.05, 0.8)
    assert not guard.start(frames[0])
    for frame in frames[1:]:
        before = guard.excluded
        found = guard.examine(frame, yaw, Quality.MEASURED, 0.1)
        assert found.changed == (guard.excluded is not before)
        if found.changed:
            left_out.append(np.mean(guard.excluded == 0))
    return left_out


def test_what_leaves_too_little_of_the_picture_is_not_left_out(turning):
    # More and more of the windscreen is wet, until too little remains.
    guard = FixedGuard()
    wet = [overlays.drops(frame, count=6 * number, size=0.025, seed=2)
           for number, frame in enumerate(turning)]
    left_out = shares(guard, wet)
    assert 0.1 < max(left_out) < 0.5
    assert np.mean(guard.excluded == 0) == left_out[-1]
    assert not guard.examine(wet[-1], None, Quality.MEASURED, 0.1).changed


def test_frames_of_another_size_are_seen_whole(turning):
    guard = FixedGuard()
    assert shares(guard, [overlays.black_bars(frame, sides=0.15) for frame in turning])
    assert guard.start(cv2.resize(turning[0], (160, 120))) and guard.excluded is None
