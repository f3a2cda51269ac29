# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishes the current pose as a transform, if tf2_msgs is installed."""

from geometry_msgs.msg import Pose, Transform, TransformStamped, Vector3
from phase_traj_ros.errors import MissingDependencyError
from phase_traj_ros.ros.entities import Entities
from rclpy.qos import QoSProfile
from std_msgs.msg import Header


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
        try:
            from tf2_msgs.msg import TFMessage
        except ImportError:
            raise MissingDependencyError(
                'publish_tf and publish_map_tf need tf2_msgs: install ros-jazzy-tf2-msgs, or leave'
                ' both off',
            ) from None
        self._message = TFMessage
        self._publisher = node.create_publisher(TFMessage, '/tf', QoSProfile(depth=100))

    def publish(self, header: Header, pose: Pose, child_frame: str) -> None:
        """Publish a pose of the vehicle in the frame of ``header`` as a transform."""
        position = pose.position
        self._publisher.publish(self._message(transforms=[TransformStamped(
            header=header, child_frame_id=child_frame,
            transform=Transform(
                translation=Vector3(x=position.x, y=position.y, z=position.z),
                rotation=pose.orientation))]))
