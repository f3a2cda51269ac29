# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The node's messages, made of the classes of ROS."""

from types import MappingProxyType
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    QuaternionStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
    Vector3Stamped,
)
from nav_msgs.msg import Odometry, Path
from phase_traj_ros.io.messages.published import Messages
from std_msgs.msg import Float32, Float64, Header, String, UInt8

TYPES = MappingProxyType({
    'builtin_interfaces/msg/Time': Time,
    'geometry_msgs/msg/Point': Point,
    'geometry_msgs/msg/Pose': Pose,
    'geometry_msgs/msg/PoseStamped': PoseStamped,
    'geometry_msgs/msg/PoseWithCovariance': PoseWithCovariance,
    'geometry_msgs/msg/Quaternion': Quaternion,
    'geometry_msgs/msg/QuaternionStamped': QuaternionStamped,
    'geometry_msgs/msg/Twist': Twist,
    'geometry_msgs/msg/TwistWithCovariance': TwistWithCovariance,
    'geometry_msgs/msg/Vector3': Vector3,
    'geometry_msgs/msg/Vector3Stamped': Vector3Stamped,
    'nav_msgs/msg/Odometry': Odometry,
    'nav_msgs/msg/Path': Path,
    'std_msgs/msg/Float32': Float32,
    'std_msgs/msg/Float64': Float64,
    'std_msgs/msg/Header': Header,
    'std_msgs/msg/String': String,
    'std_msgs/msg/UInt8': UInt8,
})
"""Classes of messages by the names of their types."""

MESSAGES = Messages(TYPES)


def to_time(stamp_ns: int) -> Any:
    """Return a stamp given in nanoseconds as a message."""
    return MESSAGES.time(stamp_ns)
