# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A distant scene all around, seen by any radially symmetric lens at any heading.

The pictures are rendered without OpenCV's lens models: the radius in the picture is given as a
function of the angle from the optical axis, and inverted by a table.
"""

from functools import cache

import cv2
import numpy as np
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.synthetic.degradations import sensor_noise
import textures

#: Lenses of OpenCV's two models; the functions below write out the radius in the picture (in focal
#: lengths) that goes with an angle from the axis.
BARREL_COEFFICIENTS = (-0.28, 0.06, 0.0, 0.0, 0.0)
FISHEYE_COEFFICIENTS = (0.03, -0.01, 0.004, -0.002)
_PX_PER_RAD = 400
_HEIGHT = 1000


def barrel(angle):
    r = np.tan(angle)
    return r * (1 - 0.28 * r**2 + 0.06 * r**4)


def fisheye(angle):
    return angle * (1 + 0.03 * angle**2 - 0.01 * angle**4 + 0.004 * angle**6 - 0.002 * angle**8)


@cache
def _scene():
    shape = (_HEIGHT, round(2 * np.pi * _PX_PER_RAD))
    texture = textures.shifted(textures.spectrum(shape, 3), shape, 0, 0)
    return np.clip(texture * 40 / texture.std() + 128, 0, 255).astype(np.float32)


def bearings(camera, radius):
    """
    Return the azimuth and the slope of each pixel of a camera's pictures.

    Of ``camera``, size, focal lengths and principal point are used; ``radius`` is the distance
    from the principal point, in focal lengths, as a function of the angle from the axis. What is
    beyond the angle at which it stops growing is NaN.
    """
    angles = np.linspace(0, np.radians(88), 8000)
    x = (np.arange(camera.width)[None] - camera.cx) / camera.fx
    y = (np.arange(camera.height)[:, None] - camera.cy) / camera.fy
    distance = np.hypot(x, y)
    reach = radius(angles)
    falling = np.diff(reach) <= 0
    last = np.argmax(falling) + 1 if falling.any() else len(reach)
    angle = np.interp(distance, reach[:last], angles[:last], right=np.nan)
    # The direction is (sideways, down, ahead).
    share = np.sin(angle) / np.maximum(distance, 1e-12)
    sideways, down, ahead = x * share, y * share, np.cos(angle)
    return np.arctan2(sideways, ahead), down / np.hypot(sideways, ahead)


def render(camera, radius, heading):
    """Return the picture, uint8, that a camera sees that has turned left by ``heading`` rad."""
    azimuth, slope = bearings(camera, radius)
    columns = ((azimuth - heading) / (2 * np.pi) % 1) * _scene().shape[1]
    rows = slope * _PX_PER_RAD + _HEIGHT / 2
    seen = np.isfinite(rows)
    columns, rows = (np.where(seen, each, 0).astype(np.float32) for each in (columns, rows))
    picture = cv2.remap(
        _scene(), columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.where(seen, picture, 0).round().astype(np.uint8)


def turned_drive():
    """
    Return a camera and the pictures of a drive: it turns right, left, left and right again.

    Each turn is a right angle, at 6 degrees a frame, and the drive ends as it has begun.
    """
    camera = CameraModel.pinhole((160, 320), 190.0)
    right, left = [-6] * 15, [6] * 15
    yaws = [
        0, *[0] * 8, *right, *[0] * 20, *left, *[0] * 8, *left, *[0] * 6, *right, *[0] * 8]
    return camera, [
        sensor_noise(render(camera, np.tan, np.radians(heading)), sigma=1.0, seed=index)
        for index, heading in enumerate(np.cumsum(yaws))]
