# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Keyframes: the heading of a slow vehicle does not depend on the frame rate."""

from dataclasses import replace
from functools import cache
import math

import cv2
import numpy as np
from phase_traj_ros.core import (
    CameraModel,
    CodeSource,
    EstimatorSettings,
    Lens,
    TrajectoryEstimator,
)
from phase_traj_ros.core.rotation import block_matcher, yaw_meter
from phase_traj_ros.core.rotation.block_matcher import Keyframe
from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion
from phase_traj_ros.core.rotation.local_shifts import BlockPicture, BlockShifts
from phase_traj_ros.core.rotation.tuning import TUNING
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
import pytest

CAMERA = Camera.with_field_of_view(480, 270, 80.0)
MODEL = CameraModel(
    width=480, height=270, fx=CAMERA.focal, fy=CAMERA.focal, cx=CAMERA.cx, cy=CAMERA.cy)
PICTURE = BlockPicture(np.zeros((8, 8), np.uint8), *np.zeros((5, 3)))


@cache
def walk():
    """Return a drive at a walking pace with a corner, at 60 frames per second."""
    drive = plan_drive('walk', [Straight(0.5), Turn(45, 2.2, 1.4), Straight(0.4)],
                       rate_hz=60.0, speed=1.4, camera=CAMERA, seed=5)
    return drive, list(render_drive(drive))


def run(every):
    """Return an estimator that has taken the walk, and its updates."""
    drive, frames = walk()
    estimator = TrajectoryEstimator(EstimatorSettings(
        code_source=CodeSource.AUTO, lens=Lens(camera=MODEL), camera_height=1.65))
    updates = [
        estimator.update(frame, stamp) for frame, stamp in
        zip(frames[::every], drive.stamps_ns.tolist()[::every])]
    return estimator, [update for update in updates if update is not None]


# For tests that only look at what came of it.
driven = cache(run)


def heading_error(updates):
    drive, _ = walk()
    return math.degrees(updates[-1].heading.heading - np.unwrap(drive.poses[:, 2])[-1])


def test_a_slow_vehicle_has_its_heading_and_its_way_at_a_high_rate(monkeypatch):
    drive, _ = walk()
    true = np.hypot(*np.diff(drive.poses[:, :2], axis=0).T).sum()
    estimator, updates = driven(1)
    assert abs(heading_error(updates)) < 0.3
    assert estimator.way.distance == pytest.approx(true, rel=0.05)
    # Most frames need no measurement.
    assert sum(update.heading.foreseen > 0.0 for update in updates) > len(updates) / 2
    # From frame to frame, the errors of each pair add up.
    from_frame_to_frame = replace(TUNING, max_keyframe_age_s=0.0, max_foreseen_s=0.0)
    for module in block_matcher, yaw_meter:
        monkeypatch.setattr(module, 'TUNING', from_frame_to_frame)
    assert abs(heading_error(run(1)[1])) > 2 * abs(heading_error(updates))


def test_the_variance_of_the_yaw_is_that_of_the_way_and_not_of_the_frames():
    claimed = [sum(update.heading.variance for update in driven(every)[1]) for every in (1, 6)]
    assert claimed[0] == pytest.approx(claimed[1], rel=1.0)
    assert min(update.heading.variance for update in driven(1)[1]) > 0.0


def test_one_search_for_the_blocks_is_enough_where_they_agree(monkeypatch):
    searches, search = [], cv2.calcOpticalFlowPyrLK
    monkeypatch.setattr(
        cv2, 'calcOpticalFlowPyrLK', lambda *those, **named: searches.append(1) or search(
            *those, **named))
    measured = [update for update in run(3)[1] if update.heading.foreseen == 0.0]
    assert len(measured) <= len(searches) < 1.1 * len(measured)


def motion(yaw, passing):
    return CameraMotion(
        yaw, 0.0, 0.0, FocusOfExpansion(), 100.0, 1.0, 1e-8, passing, near=passing)


def test_the_yaws_since_a_keyframe_add_up_to_the_last_one():
    key = Keyframe(PICTURE, FocusOfExpansion())
    blocks = BlockShifts(
        np.array([1.0, 2.0, 9.0]), np.zeros(3), np.array([1.0, 1.0, 0.0]), np.ones(3))
    yaws = (0.01, 0.025, 0.02)
    pairs = [key.add(motion(yaw, 0.01), blocks, roll=0.0) for yaw in yaws]
    assert np.cumsum([pair.yaw for pair in pairs]) == pytest.approx(yaws)
    # The blocks have not moved in the second and the third pair: the vehicle stopped meanwhile.
    assert [pair.near for pair in pairs] == [0.01, 0.0, 0.0]
    # A block that is not seen is expected where the others are.
    assert key.moved[:, 0].tolist() == [1.0, 2.0, 1.5]


def test_pitch_and_roll_since_a_keyframe_add_up_as_the_yaw_does():
    key = Keyframe(PICTURE, FocusOfExpansion())
    blocks = BlockShifts(*np.ones((4, 3)))
    turned = [(0.001, 0.002), (0.003, -0.001), (0.003, 0.005)]
    pairs = [key.add(replace(motion(0.0, 0.01), pitch=pitch, roll=roll), blocks, roll=0.0)
             for pitch, roll in turned]
    assert np.cumsum([(pair.pitch, pair.roll) for pair in pairs], axis=0) == pytest.approx(
        np.array(turned))


@pytest.mark.parametrize('roll', [0.0, -0.3])
def test_the_direction_of_travel_is_that_in_the_newest_frame(roll):
    """It is measured half-way; only a nod moves it, not the turn of a camera with a roll."""
    key, blocks = Keyframe(PICTURE, FocusOfExpansion()), BlockShifts(*np.ones((4, 3)))
    turn = replace(motion(0.05, 0.01), pitch=0.01 - 0.05 * math.tan(roll))
    assert key.add(turn, blocks, roll=roll).travel.slope == pytest.approx(0.005)
    assert key.travel.slope == 0.0


def test_what_is_near_counts_for_a_pair_by_its_share_of_the_way():
    key, nears = Keyframe(PICTURE, FocusOfExpansion()), []
    for way in (1.0, 2.0, 4.0):
        blocks = BlockShifts(np.full(3, 0.6 * way), np.full(3, 0.8 * way), *np.ones((2, 3)))
        nears.append(key.add(motion(0.0, 0.01 * way), blocks, roll=0.0).near)
    assert nears == pytest.approx([0.01, 0.01, 0.02])


@pytest.mark.parametrize('sign', [-1.0, 1.0])
def test_a_keyframe_reaches_as_far_as_blocks_can_be_compared(sign):
    """A tenth of their distance, or 4 degrees, whichever comes first."""
    key = Keyframe(PICTURE, FocusOfExpansion())
    key.age = 0.1
    assert key.is_near(0.4, sign * 0.5, 0.1)
    assert not key.is_near(0.6, 0.0, 0.1) and not key.is_near(0.0, sign * 0.8, 0.1)
    key.add(motion(sign * 0.04, 0.01), BlockShifts(*np.ones((4, 3))), roll=0.0)
    assert not key.is_near(0.4, sign * 0.5, 0.1) and key.is_near(0.4, -sign * 0.5, 0.1)


@pytest.mark.parametrize(('yaw', 'passing', 'age', 'over'), [
    (0.0, 0.001, 0.1, False), (0.0, 0.2, 0.1, True), (0.2, 0.001, 0.1, True),
    (-0.2, 0.001, 0.1, True), (0.0, 0.001, 3.0, True)])
def test_a_keyframe_is_over_when_the_image_has_moved(yaw, passing, age, over):
    key = Keyframe(PICTURE, FocusOfExpansion())
    key.age = age
    assert key.has_expired(motion(yaw, passing), 0.1) is over


def test_a_vehicle_that_moves_far_in_each_pair_is_measured_from_frame_to_frame():
    for yaw, passing in ((0.0, 0.08), (0.05, 0.001)):
        key = Keyframe(PICTURE, FocusOfExpansion())
        key.age = 0.1
        # From this frame, the next one would be too far.
        assert key.has_expired(motion(yaw, passing), 0.1)
        assert not key.has_expired(motion(yaw, passing), 0.01)
