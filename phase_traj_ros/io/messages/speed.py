# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads the vehicle's speed from messages of any library."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final


def _of_twist(message: Any) -> float:
    return float(message.twist.linear.x)


def _of_twist_with_covariance(message: Any) -> float:
    return float(message.twist.twist.linear.x)


SPEED_OF: Final[Mapping[str, Callable[[Any], float]]] = MappingProxyType({
    'geometry_msgs/msg/TwistStamped': _of_twist,
    'geometry_msgs/msg/TwistWithCovarianceStamped': _of_twist_with_covariance,
    'nav_msgs/msg/Odometry': _of_twist_with_covariance,
})
"""Functions from such a message to the x of the linear velocity, in m/s, by type name."""
