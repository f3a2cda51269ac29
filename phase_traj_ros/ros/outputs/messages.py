# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Makes the messages of the node from the ROS message classes."""

from types import MappingProxyType
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    QuaternionStamped,
    Twist,
    TwistWithCovariance,
    TwistWithCovarianceStamped,
    Vector3,
    Vector3Stamped,
)
from nav_msgs.msg import Odometry, Path
from phase_traj_ros.io.messages.published import Messages
from std_msgs.msg import Float32, Float64, Header, String, UInt8


def _status(*, level: int, **fields: Any) -> DiagnosticStatus:
    """Make a status; rclpy represents its level as a byte."""
    return DiagnosticStatus(level=bytes([level]), **fields)


TYPES = MappingProxyType({
    'builtin_interfaces/msg/Time': Time,
    'diagnostic_msgs/msg/DiagnosticArray': DiagnosticArray,
    'diagnostic_msgs/msg/DiagnosticStatus': _status,
    'diagnostic_msgs/msg/KeyValue': KeyValue,
    'geometry_msgs/msg/Point': Point,
    'geometry_msgs/msg/Pose': Pose,
    'geometry_msgs/msg/PoseStamped': PoseStamped,
    'geometry_msgs/msg/PoseWithCovariance': PoseWithCovariance,
    'geometry_msgs/msg/PoseWithCovarianceStamped': PoseWithCovarianceStamped,
    'geometry_msgs/msg/Quaternion': Quaternion,
    'geometry_msgs/msg/QuaternionStamped': QuaternionStamped,
    'geometry_msgs/msg/Twist': Twist,
    'geometry_msgs/msg/TwistWithCovariance': TwistWithCovariance,
    'geometry_msgs/msg/TwistWithCovarianceStamped': TwistWithCovarianceStamped,
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
"""Constructors of the messages, by the names of their types."""

MESSAGES = Messages(TYPES)


def to_time(stamp_ns: int) -> Any:
    """Return a stamp in nanoseconds as a builtin_interfaces/Time."""
    return MESSAGES.time(stamp_ns)
