# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The demo's drive in pictures of half the size, which cost a quarter; KITTI has the full size."""

from dataclasses import replace

from phase_traj_ros.synthetic import Camera, KITTI_CAMERA, named_drive

#: Half of KITTI's camera in each direction, with even sides.
HALF = Camera(
    620, 188, KITTI_CAMERA.focal / 2, (KITTI_CAMERA.cx - 0.5) / 2, (KITTI_CAMERA.cy - 0.5) / 2)


def half_demo(frames):
    """Return the first frames of the demo's drive, as half the camera sees it."""
    return replace(named_drive('demo'), camera=HALF).take(range(frames))
