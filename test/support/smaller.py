# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""KITTI's camera with fewer pixels, which cost less; the real drives have the full size."""

from dataclasses import replace

from phase_traj_ros.synthetic import Camera, KITTI_CAMERA, named_drive

#: Half of the pixels in each direction, with even sides.
HALF = Camera(
    620, 188, KITTI_CAMERA.focal / 2, (KITTI_CAMERA.cx - 0.5) / 2, (KITTI_CAMERA.cy - 0.5) / 2)
#: A third of them, with the principal point in the middle.
THIRD = Camera(412, 124, KITTI_CAMERA.focal / 3, 205.5, 61.5)


def half_demo(frames):
    """Return the first frames of the demo's drive, as half the camera sees it."""
    return replace(named_drive('demo'), camera=HALF).take(range(frames))
