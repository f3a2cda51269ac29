# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishes the debug image while it has subscribers."""

from phase_traj_ros.core import TrajectoryEstimator, Update
from phase_traj_ros.io.messages.topics import DEBUG_IMAGE
from phase_traj_ros.io.results.pictures import draw
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.ros.entities import Entities
from phase_traj_ros.ros.outputs.messages import MESSAGES
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image


class DebugImage:
    """Publishes ``~/debug_image``. The image is drawn only while the topic has subscribers."""

    def __init__(self, node: Entities, estimator: TrajectoryEstimator) -> None:
        """Make the publisher on ``node``."""
        self._estimator = estimator
        self._publisher = node.create_publisher(
            Image, f'~/{DEBUG_IMAGE.name}', qos_profile_sensor_data)

    def publish(self, frame: StampedFrame, update: Update) -> None:
        """Draw and publish one pair, if the topic has subscribers."""
        if self._publisher.get_subscription_count() == 0:
            return
        self._publisher.publish(MESSAGES.image(
            draw(frame, update, self._estimator),
            MESSAGES.header(update.stamp_ns, frame.frame_id)))
