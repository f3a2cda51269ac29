# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Receives the vehicle's speed."""

from collections.abc import Callable
from typing import Any

from phase_traj_ros.io.messages.speed import SPEED_OF
from phase_traj_ros.io.messages.stamps import to_nanoseconds
from phase_traj_ros.ros.entities import Entities
from phase_traj_ros.ros.outputs.messages import TYPES
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

_TOPIC = 'speed'
# The rate of the speeds may be far higher than that of the images, and all speeds are needed.
_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
_THROTTLE_S = 5.0
# Period of the search for a publisher of another type.
_LOOK_S = 0.5


class SpeedInput:
    """
    Subscribes to ``speed``: x of the linear velocity in m/s, at the stamp of the message.

    The type is that of the publisher, whenever one appears; without one, TwistStamped.
    """

    def __init__(
        self, node: Node, entities: Entities, on_speed: Callable[[int, float], None],
    ) -> None:
        """Subscribe; pass each stamp and speed to ``on_speed``, which may raise ValueError."""
        self._node, self._entities = node, entities
        self._on_speed = on_speed
        self.topic = str(node.resolve_topic_name(_TOPIC))
        """Full name of the topic after remapping."""
        self._subscribe([*self._published(), *SPEED_OF][0])
        entities.create_timer(_LOOK_S, self._follow_publisher)

    def _published(self) -> list[str]:
        """Return the types of the topic's publishers with a speed."""
        publishers = self._node.get_publishers_info_by_topic(self.topic)
        return [each.topic_type for each in publishers if each.topic_type in SPEED_OF]

    def _follow_publisher(self) -> None:
        published = self._published()
        if published and self._type not in published:
            self._node.destroy_subscription(self._subscription)
            self._subscribe(published[0])
            self._node.get_logger().info(f'{self.topic} is a {self._type}')

    def _subscribe(self, message_type: str) -> None:
        self._type = message_type
        self._subscription = self._entities.create_subscription(
            TYPES[message_type], _TOPIC, self._on_message, _QOS)

    def _on_message(self, message: Any) -> None:
        stamp_ns = to_nanoseconds(message.header.stamp)
        if stamp_ns == 0:
            stamp_ns = self._node.get_clock().now().nanoseconds
        try:
            self._on_speed(stamp_ns, SPEED_OF[self._type](message))
        except ValueError as error:
            self._node.get_logger().error(
                f'skipped a speed on {self.topic}: {error}',
                throttle_duration_sec=_THROTTLE_S)
