# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads the vehicle's speed from messages of any library."""

from collections.abc import Callable, Mapping
from operator import attrgetter
from types import MappingProxyType
from typing import Any

SPEED_OF: Mapping[str, Callable[[Any], float]] = MappingProxyType({
    'geometry_msgs/msg/TwistStamped': attrgetter('twist.linear.x'),
    'geometry_msgs/msg/TwistWithCovarianceStamped': attrgetter('twist.twist.linear.x'),
    'nav_msgs/msg/Odometry': attrgetter('twist.twist.linear.x'),
})
"""Functions from such a message to the x of the linear velocity, in m/s, by type name."""
