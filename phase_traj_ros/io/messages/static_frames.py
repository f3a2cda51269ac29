# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The tree of frames from /tf_static.

This module does not need ROS: it accepts any object with the fields of tf2_msgs/TFMessage.
Sources: REP 103 (axes of bodies and of optical frames), REP 105 (base_link) and REP 120
(base_footprint).
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.io.messages.mounting import Mount

STATIC_TOPIC = '/tf_static'
TF_TYPE = 'tf2_msgs/msg/TFMessage'
FOOTPRINT = 'base_footprint'
"""Frame on the ground below the vehicle, from which heights are measured if it is there."""

# Sines of the pitches of a steep camera, up to somewhat more than can be used.
_STEEP = 0.5, 0.9
# A chain of frames that is longer is a circle.
_LONGEST_CHAIN = 100
# From the axes of a body (x ahead, y left, z up) to those of a picture (z ahead, x right, y down).
_OPTICAL_IN_BODY = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])

_Pose = NDArray[np.float64]


class StaticFrames:
    """The tree of frames from /tf_static."""

    def __init__(self) -> None:
        """Know no frame."""
        self._above: dict[str, tuple[str, _Pose]] = {}

    def add(self, message: Any) -> None:
        """Add the transforms of a tf2_msgs/TFMessage; one that is not a pose is left out."""
        for transform in message.transforms:
            part = transform.transform
            pose = np.eye(4)
            pose[:3, :3] = _rotation(part.rotation)
            pose[:3, 3] = part.translation.x, part.translation.y, part.translation.z
            if np.isfinite(pose).all():
                self._above[_bare(transform.child_frame_id)] = (
                    _bare(transform.header.frame_id), pose)

    def mount(self, base: str, camera: str) -> Mount | None:
        """Return how the frame ``camera`` is mounted on ``base``; None if that is unknown."""
        pose = self._between(_bare(base), _bare(camera))
        if pose is None:
            return None
        optical = _optical(pose[:3, :3])
        prefix = _bare(base).rpartition('/')[0]
        footprint = f'{prefix}/{FOOTPRINT}'.lstrip('/')
        ground = self._between(footprint, _bare(camera))
        return Mount(
            _bare(base), _bare(camera), float(pose[0, 3]), float(pose[1, 3]),
            float((pose if ground is None else ground)[2, 3]),
            pitch_deg=math.degrees(math.asin(float(np.clip(-optical[2, 2], -1.0, 1.0)))),
            roll_deg=_roll_deg(optical), yaw_deg=_yaw_deg(optical),
            ground_frame=_bare(base) if ground is None else footprint)

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


def rotation_matrices(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotations (..., 3, 3) of quaternions (..., 4) of length 1, x y z w."""
    axes, reals = quaternions[..., :3], quaternions[..., 3, None, None]
    crossed = np.cross(np.eye(3), axes[..., None, :])
    return np.asarray(np.eye(3) + 2 * reals * crossed + 2 * crossed @ crossed)


def _rotation(quaternion: Any) -> _Pose:
    """Return the matrix of a geometry_msgs/Quaternion, (3, 3); NaN if its length is not usable."""
    parts = np.array([quaternion.x, quaternion.y, quaternion.z, quaternion.w])
    norm = np.linalg.norm(parts)
    return rotation_matrices(parts / norm if 1e-6 < norm < math.inf else parts * math.nan)


def _bare(frame: str) -> str:
    return frame.lstrip('/')
