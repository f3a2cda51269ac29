# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The rendered drives give the intended codes."""

from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np
from phase_traj_ros.core import DynamicChainCode
from phase_traj_ros.synthetic import KITTI_CAMERA, named_drive, render_drive
import pytest
from smaller import HALF


def shifts(drive, scene):
    """Return dx of every pair, in pixels of the full picture, by OpenCV's phase correlation."""
    window = cv2.createHanningWindow((HALF.width, HALF.height), cv2.CV_32F)
    frames = [frame.astype(np.float32) for frame in render_drive(drive, scene=scene)]
    return np.array([
        2 * cv2.phaseCorrelate(before, after, window)[0][0]
        for (before, after) in pairwise(frames)])


def directions(dx, threshold):
    code = DynamicChainCode(threshold)
    steps = [code.update(value) for value in dx]
    series = [int(step.direction) for step in steps]
    changes = [
        after for (before, after) in zip([None, *series], series) if after != before]
    return (len(steps), changes)


@pytest.mark.parametrize(('name', 'frames', 'expected'), [
    ('demo', 201, [1, 0, 1, 0]), ('paper_case_1', 241, [1, 2, 3]),
    ('paper_case_2', 200, [1, 0, 1, 2])])
def test_a_named_drive_has_its_directions(name, frames, expected, scene_of_drive):
    drive = replace(named_drive(name), camera=HALF)
    dx = shifts(drive, scene_of_drive(name))
    for threshold in (12.0, 16.0, 20.0, 30.0):
        assert directions(dx, threshold) == (frames - 1, expected)
    true = KITTI_CAMERA.focal * np.tan(np.diff(drive.poses[:, 2]))
    (straight, turning) = (np.abs(true) < 1e-6, np.abs(true) > 25)
    assert np.abs(dx[straight]).max() < 8
    assert np.abs(dx[turning]).min() > 21
    assert np.median(np.abs(dx - true)[turning]) < 1.5
