# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
How the camera is mounted on the vehicle, from the transforms on /tf_static.

This module does not need ROS: it accepts any object with the fields of tf2_msgs/TFMessage.
Sources: REP 103 (axes of bodies and of optical frames), REP 105 (base_link) and REP 120
(base_footprint).
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Update
from phase_traj_ros.core.camera.lens import MOST_TILT_DEG
from phase_traj_ros.core.path.odometry import Odometry
from phase_traj_ros.core.path.trajectory import Corner
from phase_traj_ros.parameters import Parameters

STATIC_TOPIC: Final = '/tf_static'
TF_TYPE: Final = 'tf2_msgs/msg/TFMessage'
FOOTPRINT: Final = 'base_footprint'
"""Frame on the ground below the vehicle, from which heights are measured if it is there."""

# Less is the rounding of a chain of frames, or a vehicle frame at the camera.
_LEAST_HEIGHT_M, _MOST_HEIGHT_M = 0.01, 100.0
# With 10 degrees, a rendered drive of 131 m has 1 to 2 % less distance and ends 1.4 m off; with 20
# degrees, 7 % and 7 m.
_MOST_ASIDE_DEG = 15.0
# Sines of the pitches of a steep camera, up to somewhat more than can be used.
_STEEP = 0.5, 0.9
# A chain of frames that is longer is a circle.
_LONGEST_CHAIN = 100
# From the axes of a body (x ahead, y left, z up) to those of a picture (z ahead, x right, y down).
_OPTICAL_IN_BODY = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])

_Pose = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Mount:
    """Place and angles of a camera on the vehicle, in the axes of the vehicle (REP 103)."""

    base_frame: str
    camera_frame: str
    x: float
    """Metres ahead of the origin of the vehicle."""
    y: float
    """Metres to the left of it."""
    height: float
    """Metres above the ground: above ``base_footprint`` if it is known, else above the origin."""
    pitch_deg: float
    """Positive down."""
    roll_deg: float
    """Positive right side down; 180 for a camera that is mounted upside down."""
    yaw_deg: float
    """Positive to the left."""

    def __str__(self) -> str:
        """Return a description."""
        return (
            f'{self.camera_frame} is {self.height:.2f} m high, {self.x:.2f} m ahead and'
            f' {self.y:.2f} m left of {self.base_frame}, pitch {self.pitch_deg:.1f} deg down, roll'
            f' {self.roll_deg:.1f} deg, yaw {self.yaw_deg:.1f} deg')

    def fill_in(self, values: Parameters) -> tuple[Parameters, tuple[str, ...]]:
        """
        Return ``values`` with those that nobody has set, and the names of these.

        Angles and heights that no camera for this package can have are left out.
        """
        roll = self.roll_deg
        if values.rotate_180:
            roll = math.remainder(roll + 180.0, 360.0)
        found: dict[str, object] = {}
        if values.camera_height == 0.0 and _LEAST_HEIGHT_M <= self.height <= _MOST_HEIGHT_M:
            found['camera_height'] = self.height
        if max(abs(self.pitch_deg), abs(roll)) <= MOST_TILT_DEG:
            if values.camera_pitch_deg == 0.0:
                found['camera_pitch_deg'] = self.pitch_deg
            if values.camera_roll_deg == 0.0:
                found['camera_roll_deg'] = roll
        return values.with_values(found), tuple(found)

    def told(self, used: Iterable[str]) -> str:
        """Return a sentence on the mount, and on the values ``used`` from it."""
        return f'/tf_static: {self}; from there: {", ".join((*used, "the lever arm of odom"))}'

    def doubts(self, values: Parameters) -> Iterator[str]:
        """Yield what is doubtful about the camera that ``values`` are for, in sentences."""
        if abs(self.roll_deg) > 90.0 and not values.rotate_180:
            yield (f'{self.camera_frame} is mounted upside down: set rotate_180, unless the driver'
                   ' turns the images')
        if abs(self.yaw_deg) > _MOST_ASIDE_DEG:
            side = 'left' if self.yaw_deg > 0.0 else 'right'
            yield (f'{self.camera_frame} looks {abs(self.yaw_deg):.0f} degrees to the {side}:'
                   f' headings and distances are right up to about {_MOST_ASIDE_DEG:g} degrees')

    def at_base(self, update: Update, values: Parameters) -> Update:
        """
        Return ``update`` with the odometry of the vehicle's origin instead of the camera's.

        The pose moves along the heading, as the point of the vehicle does that never slips
        sideways, such as the middle of the rear axle. The origin is taken to be there: a camera
        ahead of it changes nothing, and one to the left of it drives a shorter arc to the left.
        A speed that ``values`` give is that of the origin, so nothing is corrected.
        """
        settings = values.settings
        if update.odometry is None or settings.speed or settings.awaits_speeds:
            return update
        return replace(update, odometry=_at_origin(update.odometry, self.y))


class StaticFrames:
    """The tree of frames from /tf_static."""

    def __init__(self) -> None:
        """Know no frame."""
        self._above: dict[str, tuple[str, _Pose]] = {}

    def add(self, message: Any) -> None:
        """Add the transforms of a tf2_msgs/TFMessage; one that is not a pose is left out."""
        for transform in message.transforms:
            self._add(transform)

    def _add(self, transform: Any) -> None:
        part = transform.transform
        rotation = _rotation(part.rotation)
        if rotation is None:
            return
        pose = np.eye(4)
        pose[:3, :3] = rotation
        pose[:3, 3] = part.translation.x, part.translation.y, part.translation.z
        if not np.isfinite(pose).all():
            return
        self._above[_bare(transform.child_frame_id)] = _bare(transform.header.frame_id), pose

    def mount(self, base: str, camera: str) -> Mount | None:
        """Return how the frame ``camera`` is mounted on ``base``; None if that is unknown."""
        pose = self._between(_bare(base), _bare(camera))
        if pose is None:
            return None
        optical = _optical(pose[:3, :3])
        prefix = _bare(base).rpartition('/')[0]
        ground = self._between(f'{prefix}/{FOOTPRINT}'.lstrip('/'), _bare(camera))
        return Mount(
            _bare(base), _bare(camera), float(pose[0, 3]), float(pose[1, 3]),
            float((pose if ground is None else ground)[2, 3]),
            pitch_deg=math.degrees(math.asin(float(np.clip(-optical[2, 2], -1.0, 1.0)))),
            roll_deg=_roll_deg(optical), yaw_deg=_yaw_deg(optical))

    def _between(self, base: str, camera: str) -> _Pose | None:
        """Return the pose of ``camera`` in ``base``, (4, 4); None if they are not connected."""
        root, of_base = self._to_root(base)
        other, of_camera = self._to_root(camera)
        if root != other or base == camera:
            return None
        return np.asarray(np.linalg.inv(of_base) @ of_camera, np.float64)

    def _to_root(self, frame: str) -> tuple[str, _Pose]:
        pose: _Pose = np.eye(4)
        for _ in range(_LONGEST_CHAIN):
            if frame not in self._above:
                break
            frame, step = self._above[frame]
            pose = step @ pose
        return frame, pose


def _optical(axes: _Pose) -> _Pose:
    """
    Return the axes of a picture from those of its frame, (3, 3) each.

    The frame of an image is an optical one (REP 103), but some drivers give that of the housing,
    whose z axis is upright. A steep one is read so that it looks ahead, with a roll of 0 or 180
    degrees.
    """
    housing, upright = axes @ _OPTICAL_IN_BODY, abs(axes[2, 2])
    if not _STEEP[0] < upright < _STEEP[1]:
        return axes if upright < math.sqrt(0.5) else housing
    return min((axes, housing), key=lambda each: abs(
        math.remainder(_roll_deg(each), 180.0)) + abs(_yaw_deg(each)))


def _roll_deg(optical: _Pose) -> float:
    return math.degrees(math.atan2(-optical[2, 0], -optical[2, 1]))


def _yaw_deg(optical: _Pose) -> float:
    return math.degrees(math.atan2(optical[1, 2], optical[0, 2]))


def _at_origin(odometry: Odometry, left: float) -> Odometry:
    pose, covariance = odometry.pose, np.array(odometry.covariance)
    along, across = left * math.sin(pose.yaw), left * (1.0 - math.cos(pose.yaw))
    change = np.array([[1.0, 0.0, left - across], [0.0, 1.0, along], [0.0, 0.0, 1.0]])
    moved = (change @ covariance @ change.T).tolist()
    return replace(
        odometry,
        pose=Corner(pose.x + along, pose.y + across, pose.yaw, pose.stamp_ns),
        speed=odometry.speed + odometry.yaw_rate * left,
        speed_variance=odometry.speed_variance + left * left * odometry.yaw_rate_variance,
        covariance=(tuple(moved[0]), tuple(moved[1]), tuple(moved[2])))


def _rotation(quaternion: Any) -> _Pose | None:
    """Return the matrix of a geometry_msgs/Quaternion, (3, 3); None if it is zero or NaN."""
    parts = np.array([quaternion.x, quaternion.y, quaternion.z, quaternion.w])
    norm = np.linalg.norm(parts)
    if not 1e-6 < norm < math.inf:
        return None
    *axis, real = parts / norm
    crossed = np.cross(np.eye(3), axis)
    return np.asarray(np.eye(3) + 2 * real * crossed + 2 * crossed @ crossed)


def _bare(frame: str) -> str:
    return frame.lstrip('/')
