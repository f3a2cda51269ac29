# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The camera, and its pose.

World and body axes are those of REP 103: x forward (east), y left (north), z up. Yaw is
counter-clockwise, a positive pitch turns the nose down, a positive roll the right side down.
Image axes are those of a pinhole camera: columns to the right, rows down, the centre of the
first pixel at (0, 0).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
import math
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.synthetic.arrays import Floats

#: Rotates body axes (x forward, y left, z up) to image axes (x right, y down, z forward).
BODY_TO_PICTURE = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])

#: Fisheyes, as coefficients k1 to k4 of r = f (a + k1 a^3 + k2 a^5 + k3 a^7 + k4 a^9), where a is
#: the angle from the optical axis and r the distance from the principal point: the series of
#: r = 2 f tan(a / 2), r = f a and r = 2 f sin(a / 2).
STEREOGRAPHIC = (1 / 12, 1 / 120, 17 / 20160, 31 / 362880)
EQUIDISTANT = (0.0, 0.0, 0.0, 0.0)
EQUISOLID = (-1 / 24, 1 / 1920, -1 / 322560, 1 / 92897280)

#: A tilted view is cut out of a level one, which would be very large beyond this slope of a ray.
_STEEPEST = 1.5


Fisheye: TypeAlias = tuple[float, float, float, float]


class Pose(NamedTuple):
    """Position of the camera in metres, and its orientation in radians (REP 103)."""

    x: float
    y: float
    yaw: float
    pitch: float = 0.0
    roll: float = 0.0


@dataclass(frozen=True, slots=True)
class Camera:
    """
    An ideal camera with square pixels: a pinhole, or a fisheye if it has coefficients.

    Lengths in the image are in pixels, ``above_ground`` is in metres, ``fisheye`` is as
    ``EQUIDISTANT``.
    """

    width: int = 1241
    height: int = 376
    focal: float = 718.856
    cx: float = 607.1928
    cy: float = 185.2157
    above_ground: float = 1.65
    fisheye: Fisheye | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        if min(self.width, self.height) < 1:
            raise ParameterError(
                f'an image cannot have {self.width} x {self.height} pixels: '
                'width and height must be at least 1')
        if not (math.isfinite(self.focal) and self.focal > 0 and self.above_ground > 0):
            raise ParameterError(
                'the focal length and the height above ground must be positive numbers, not '
                f'{self.focal} px and {self.above_ground} m')

    @classmethod
    def with_field_of_view(
        cls, width: int, height: int, hfov_deg: float, *, above_ground: float = 1.65,
        fisheye: Fisheye | None = None,
    ) -> Camera:
        """Return a camera with the field of view ``hfov_deg`` from edge to edge, centred."""
        if not 0 < hfov_deg < 160:
            raise ParameterError(
                f'a field of view of {hfov_deg} degrees cannot be drawn on a plane: '
                'give one between 0 and 160')
        half = math.radians(hfov_deg) / 2
        radius = math.tan(half) if fisheye is None else float(fisheye_radius(half, fisheye))
        return cls(width, height, width / 2 / radius, (width - 1) / 2, (height - 1) / 2,
                   above_ground, fisheye)

    def matrix(self) -> Floats:
        """Return the 3 x 3 camera matrix K."""
        return np.array([[self.focal, 0.0, self.cx], [0.0, self.focal, self.cy], [0.0, 0.0, 1.0]])


#: The left grey camera of the KITTI odometry benchmark (sequences 00 to 02).
KITTI_CAMERA = Camera()


def fisheye_radius(angle: npt.ArrayLike, fisheye: Fisheye) -> Floats:
    """Return r / f at each angle from the optical axis, in radians."""
    given = np.asarray(angle, np.float64)
    square = given * given
    (k1, k2, k3, k4) = fisheye
    series: Floats = 1.0 + square * (k1 + square * (k2 + square * (k3 + square * k4)))
    return given * series


def rotation(yaw: float, pitch: float, roll: float) -> Floats:
    """Return the 3 x 3 matrix body to world of yaw, then pitch, then roll, in radians."""
    (cy, cp, cr) = np.cos((yaw, pitch, roll))
    (sy, sp, sr) = np.sin((yaw, pitch, roll))
    return np.array([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr]])


def tilt(pitch: float, roll: float) -> Floats:
    """Return the 3 x 3 matrix from image axes to those of a level camera; angles in radians."""
    matrix: Floats = BODY_TO_PICTURE @ rotation(0.0, pitch, roll) @ BODY_TO_PICTURE.T
    return matrix


def quaternion(pose: Pose) -> tuple[float, float, float, float]:
    """Return the orientation as a quaternion: x, y, z, w."""
    (cy, cp, cr) = np.cos((pose.yaw / 2, pose.pitch / 2, pose.roll / 2))
    (sy, sp, sr) = np.sin((pose.yaw / 2, pose.pitch / 2, pose.roll / 2))
    return (
        float(sr * cp * cy - cr * sp * sy), float(cr * sp * cy + sr * cp * sy),
        float(cr * cp * sy - sr * sp * cy), float(cr * cp * cy + sr * sp * sy))


def level_view(camera: Camera, pitch: float, roll: float) -> tuple[Camera, Floats]:
    """
    Return a level camera that sees all that a tilted one sees, and their homography.

    The homography (3 x 3) maps the pixels of the tilted image to those of the level one. It is
    exact because both cameras are at the same point.
    """
    to_level = tilt(pitch, roll) @ np.linalg.inv(camera.matrix())
    (right, bottom) = (camera.width - 1.0, camera.height - 1.0)
    corners = to_level @ np.array([
        [0.0, right, 0.0, right], [0.0, 0.0, bottom, bottom], [1.0, 1.0, 1.0, 1.0]])
    slopes = corners[:2] / np.maximum(corners[2], 1e-6)
    if corners[2].min() <= 0 or np.abs(slopes[1]).max() > _STEEPEST:
        raise ParameterError(
            f'a camera pitched by {math.degrees(pitch):.1f} and rolled by '
            f'{math.degrees(roll):.1f} degrees cannot be rendered: keep it nearly level')
    low = np.floor(camera.focal * slopes.min(axis=1)).astype(int) - 1
    high = np.ceil(camera.focal * slopes.max(axis=1)).astype(int) + 1
    level = replace(
        camera, width=int(high[0] - low[0] + 1), height=int(high[1] - low[1] + 1),
        cx=float(-low[0]), cy=float(-low[1]))
    return (level, level.matrix() @ to_level)


def poses_from_kitti(matrices: npt.ArrayLike) -> Floats:
    """
    Return KITTI poses as x, y, yaw, pitch, roll, (N, 5).

    ``matrices`` is (N, 12), the lines of a KITTI pose file: 3 x 4 camera to world, row-major, with
    x to the right, y down, z forward, metres. The result is in metres and radians in REP 103
    axes: x is KITTI's z, y its -x. The height is dropped, and yaw is not wrapped. Raises
    `ParameterError` for another shape.
    """
    given = np.asarray(matrices, np.float64)
    if given.ndim != 2 or given.shape[1] != 12 or not np.isfinite(given).all():
        raise ParameterError(
            'KITTI poses are lines of 12 finite numbers (3 x 4 camera to world), not an array '
            f'of shape {given.shape}')
    camera_to_world = given.reshape(-1, 3, 4)
    turned = BODY_TO_PICTURE.T @ camera_to_world[:, :, :3] @ BODY_TO_PICTURE
    yaw = np.unwrap(np.arctan2(turned[:, 1, 0], turned[:, 0, 0]))
    pitch = -np.arcsin(np.clip(turned[:, 2, 0], -1.0, 1.0))
    roll = np.arctan2(turned[:, 2, 1], turned[:, 2, 2])
    place = camera_to_world[:, :, 3] @ BODY_TO_PICTURE
    return np.stack([place[:, 0], place[:, 1], yaw, pitch, roll], axis=1)
