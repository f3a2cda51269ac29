# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Fisheye images, level or tilted, composed of level pinhole views side by side.

The views share the position of the camera, so each ray of the fisheye is a pixel of one of them.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np
from phase_traj_ros.synthetic.arrays import as_bytes, Bytes, Floats, Singles
from phase_traj_ros.synthetic.camera import Camera, fisheye_radius, Pose, tilt

#: Half the angle of a view, in radians; a margin for the interpolation is added.
_HALF = np.radians(30.0)
_MARGIN = 2
#: Steeper rays, by their slope, are clamped to this slope.
_STEEPEST = 1.7
#: Largest angle from the axis of a lens, in radians.
_WIDEST = 2.0


def rays(camera: Camera) -> Floats:
    """Return the unit vector of each pixel of a fisheye, (height, width, 3), in image axes."""
    assert camera.fisheye is not None
    x = (np.arange(camera.width) - camera.cx) / camera.focal
    y = ((np.arange(camera.height) - camera.cy) / camera.focal)[:, None]
    radius = np.hypot(x, y)
    angles = np.linspace(0.0, _WIDEST, 4001)
    known = np.maximum.accumulate(fisheye_radius(angles, camera.fisheye))
    angle = np.interp(radius, known, angles)
    scale = np.sin(angle) / np.maximum(radius, 1e-12)
    return np.stack(np.broadcast_arrays(x * scale, y * scale, np.cos(angle)), axis=-1)


@lru_cache(maxsize=4)
def _cut(
    camera: Camera, pitch: float, roll: float,
) -> tuple[Camera, list[float], Singles, Singles]:
    """
    Return the views that cover the image of a fisheye; pitch and roll in radians.

    These are their camera, their yaw (clockwise, radians), and the column and the row of each
    pixel in them.
    """
    (x, y, z) = np.moveaxis(rays(camera) @ tilt(pitch, roll).T, -1, 0)
    azimuth = np.arctan2(x, z)
    view = np.rint(azimuth / (2 * _HALF)).astype(int)
    slope = np.clip(y / np.maximum(np.hypot(x, z), 1e-9), -_STEEPEST, _STEEPEST)
    within = azimuth - 2 * _HALF * view
    focal = camera.focal
    half = int(np.ceil(focal * np.tan(_HALF))) + _MARGIN
    height = focal * slope / np.cos(within)
    (above, below) = (int(np.ceil(side)) + _MARGIN for side in (-height.min(), height.max()))
    level = replace(
        camera, width=2 * half + 1, height=above + below + 1, cx=half, cy=above, fisheye=None)
    columns = focal * np.tan(within) + half + (view - view.min()) * level.width
    turned = (2 * _HALF * np.arange(view.min(), view.max() + 1)).tolist()
    return (level, turned, columns.astype(np.float32), (height + above).astype(np.float32))


def draw_fisheye(camera: Camera, pose: Pose, draw: Callable[[Camera, Pose], Bytes]) -> Bytes:
    """Return the image of a fisheye; ``draw`` renders that of a level pinhole camera."""
    (level, turned, columns, rows) = _cut(camera, pose.pitch, pose.roll)
    views = [draw(level, Pose(pose.x, pose.y, pose.yaw - yaw)) for yaw in turned]
    return as_bytes(cv2.remap(np.hstack(views), columns, rows, cv2.INTER_LINEAR))
