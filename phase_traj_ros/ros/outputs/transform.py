# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishes the pose of the vehicle, or that of its odometry on the map, as a transform."""

from collections import deque
from typing import Any

from geometry_msgs.msg import Pose, Transform, TransformStamped, Vector3
from phase_traj_ros.errors import needing
from phase_traj_ros.ros.entities import Entities
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Header

# Number of own transforms that are recognised on /tf.
_OWN = 200


class TransformOutput:
    """
    Publishes the transform from ``frame_id`` to ``child_frame_id`` on /tf.

    It is off by default: on a vehicle with localisation, another node publishes the transform of
    base_link, and a frame with two parents breaks the tf tree.
    """

    def __init__(self, node: Entities) -> None:
        """
        Make the publisher on ``node``.

        Raises
        ------
        MissingDependencyError
            tf2_msgs is not installed.

        """
        with needing(
                'publish_tf and publish_map_tf need tf2_msgs',
                'install ros-jazzy-tf2-msgs, or leave both off'):
            from tf2_msgs.msg import TFMessage
        self.message_type = TFMessage
        """Class of the messages."""
        self._publisher = node.create_publisher(TFMessage, '/tf', QoSProfile(depth=100))

    def publish(self, header: Header, pose: Pose, child_frame: str) -> None:
        """Publish a pose of the vehicle in the frame of ``header`` as a transform."""
        position = pose.position
        self._publisher.publish(self.message_type(transforms=[TransformStamped(
            header=header, child_frame_id=child_frame,
            transform=Transform(
                translation=Vector3(x=position.x, y=position.y, z=position.z),
                rotation=pose.orientation))]))


class MapTransform:
    """
    Publishes the pose of the odometry frame in the map frame (REP 105).

    A frame with two parents breaks the tf tree. So it stops publishing as soon as another node
    gives the frame a parent on /tf or /tf_static.
    """

    def __init__(self, node: Node, entities: Entities, frame_id: str) -> None:
        """
        Make the publisher and the subscriptions; ``frame_id`` is the frame of the odometry.

        Raises
        ------
        MissingDependencyError
            tf2_msgs is not installed.

        """
        self._node = node
        self._frame = frame_id
        self._own: deque[Any] = deque(maxlen=_OWN)
        self.other = False
        """Whether another node publishes a parent of the frame."""
        self._output = TransformOutput(entities)
        for topic, durability in (
                ('/tf', DurabilityPolicy.VOLATILE),
                ('/tf_static', DurabilityPolicy.TRANSIENT_LOCAL)):
            entities.create_subscription(
                self._output.message_type, topic, self._on_transforms,
                QoSProfile(depth=100, durability=durability))

    def publish(self, header: Header, pose: Pose) -> None:
        """Publish the pose of the frame in the frame of ``header``."""
        if not self.other:
            self._own.append(_key(header, pose.position))
            self._output.publish(header, pose, self._frame)

    def _on_transforms(self, message: Any) -> None:
        if self.other:
            return
        for each in message.transforms:
            if each.child_frame_id == self._frame and (
                    _key(each.header, each.transform.translation) not in self._own):
                self.other = True
                self._node.get_logger().error(
                    f'another node publishes the transform {each.header.frame_id} ->'
                    f' {self._frame}, so this one does not: leave publish_map_tf off, or stop'
                    ' the other node')
                return


def _key(header: Any, position: Any) -> tuple[Any, ...]:
    return (header.frame_id, header.stamp.sec, header.stamp.nanosec, position.x, position.y)
