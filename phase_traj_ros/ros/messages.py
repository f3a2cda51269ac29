# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""From the estimator's values to ROS messages; pure functions."""

import math

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion, Vector3, Vector3Stamped
from nav_msgs.msg import Path
from phase_traj_ros.core import ChainPath, Corner, Shift, yaw
from std_msgs.msg import Header

_NANOSECONDS = 10**9


def to_time(stamp_ns: int) -> Time:
    """Return a stamp given in nanoseconds as a message."""
    seconds, nanoseconds = divmod(stamp_ns, _NANOSECONDS)
    return Time(sec=seconds, nanosec=nanoseconds)


def shift_message(shift: Shift | None, header: Header) -> Vector3Stamped:
    """Return the raw shift in pixels; NaN where the two frames cannot be compared."""
    dx, dy = (math.nan, math.nan) if shift is None else (shift.dx, shift.dy)
    return Vector3Stamped(header=header, vector=Vector3(x=dx, y=dy, z=0.0))


def pose_message(corner: Corner, step_length: float, header: Header) -> PoseStamped:
    """Return a corner of the path as a pose, in steps of ``step_length`` metres."""
    half = yaw(corner.heading) / 2
    return PoseStamped(header=header, pose=Pose(
        position=Point(x=corner.x * step_length, y=corner.y * step_length, z=0.0),
        orientation=Quaternion(x=0.0, y=0.0, z=math.sin(half), w=math.cos(half)),
    ))


def path_message(path: ChainPath, step_length: float, header: Header) -> Path:
    """Return the path's corner points and its tip."""
    points = path.corners if path.tip is None else (*path.corners, path.tip)
    return Path(header=header, poses=[
        pose_message(
            point, step_length, Header(stamp=to_time(point.stamp_ns), frame_id=header.frame_id))
        for point in points
    ])
