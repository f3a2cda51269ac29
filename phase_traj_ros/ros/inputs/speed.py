# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Receives the vehicle's speed."""

from collections.abc import Callable
from types import MappingProxyType
from typing import Any

from geometry_msgs.msg import TwistStamped, TwistWithCovarianceStamped
from nav_msgs.msg import Odometry
from phase_traj_ros.io.messages.speed import SPEED_OF, SPEED_TYPES
from phase_traj_ros.io.messages.stamps import to_nanoseconds
from phase_traj_ros.parameters import SpeedType
from phase_traj_ros.ros.entities import Entities
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

_TOPIC = 'speed'
# The rate of the speeds may be far higher than that of the images, and all speeds are needed.
_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
_THROTTLE_S = 5.0
_CLASSES = MappingProxyType({
    SpeedType.TWIST: TwistStamped,
    SpeedType.TWIST_WITH_COVARIANCE: TwistWithCovarianceStamped,
    SpeedType.ODOMETRY: Odometry,
})


class SpeedInput:
    """Subscribes to ``speed``: x of the linear velocity in m/s, at the stamp of the message."""

    def __init__(
        self, node: Node, entities: Entities, speed_type: SpeedType,
        on_speed: Callable[[int, float], None],
    ) -> None:
        """Subscribe; pass each stamp and speed to ``on_speed``, which may raise ValueError."""
        self._node = node
        self._speed_of = SPEED_OF[SPEED_TYPES[speed_type]]
        self._on_speed = on_speed
        self._subscription = entities.create_subscription(
            _CLASSES[speed_type], _TOPIC, self._on_message, _QOS,
            qos_overriding_options=QoSOverridingOptions.with_default_policies())

    @property
    def topic(self) -> str:
        """Return the full name of the topic after remapping."""
        return str(self._subscription.topic_name)

    def _on_message(self, message: Any) -> None:
        stamp_ns = to_nanoseconds(message.header.stamp)
        if stamp_ns == 0:
            stamp_ns = self._node.get_clock().now().nanoseconds
        try:
            self._on_speed(stamp_ns, self._speed_of(message))
        except ValueError as error:
            self._node.get_logger().error(
                f'skipped a speed on {self.topic}: {error}',
                throttle_duration_sec=_THROTTLE_S)
