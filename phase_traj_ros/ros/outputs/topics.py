# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The publishers of the node."""

import time

from phase_traj_ros.core import TrajectoryEstimator, Update
from phase_traj_ros.io.messages.schedule import Schedule
from phase_traj_ros.io.messages.topics import (
    DEBUG_IMAGE,
    ODOMETRY,
    pair_topics,
    Topic,
    whole_topics,
)
from phase_traj_ros.io.results.pictures import draw
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.entities import Entities, LATCHED, PER_PAIR
from phase_traj_ros.ros.outputs.messages import MESSAGES, TYPES
from phase_traj_ros.ros.outputs.transform import TransformOutput
from rclpy.publisher import Publisher
from rclpy.qos import qos_profile_sensor_data

# Period at which delayed content is published while no pair arrives.
_FLUSH_S = 0.25


class Outputs:
    """
    Publishes the results of each pair of frames.

    Codes, shift, response, status and pose are published with every pair, if they have
    subscribers. The texts of the codes and the path are published by the schedule, also without
    subscribers, for late ones.
    """

    def __init__(
        self, node: Entities, estimator: TrajectoryEstimator, parameters: Parameters,
    ) -> None:
        """Make the publishers on ``node``."""
        self.parameters = parameters
        self._estimator = estimator
        topics = pair_topics(parameters)
        self._per_pair = {topic.name: _publisher(node, topic) for topic in topics}
        self._of_all = {topic: _publisher(node, topic) for topic in whole_topics(parameters)}
        self._debug_image = node.create_publisher(
            TYPES[DEBUG_IMAGE.type], f'~/{DEBUG_IMAGE.name}', qos_profile_sensor_data)
        # REP 105 needs metres.
        has_transform = parameters.publish_tf and parameters.settings.metric
        self._transform = TransformOutput(node) if has_transform else None
        # What is needed without subscribers.
        self._always = {topic.name for topic in topics if topic.latched or (
            has_transform and topic == ODOMETRY)}
        self._schedule = Schedule(parameters)
        self._timer = node.create_timer(_FLUSH_S, self._publish_due)

    def publish(self, frame: StampedFrame, update: Update) -> None:
        """Publish the results of a pair of frames; ``frame`` is the second frame."""
        for topic, message in MESSAGES.of_pair(
                update, self.parameters, camera_frame=frame.frame_id, wanted=self._is_wanted):
            self._per_pair[topic].publish(message)
            if self._transform is not None and topic == ODOMETRY.name:
                self._transform.publish(
                    message.header, message.pose.pose, self.parameters.child_frame_id)
        if self._debug_image.get_subscription_count():
            self._debug_image.publish(MESSAGES.image(
                draw(frame, update, self._estimator),
                MESSAGES.header(update.stamp_ns, frame.frame_id)))
        self._schedule.add(update)
        self._publish_due()

    def _is_wanted(self, topic: str) -> bool:
        """Return whether the message of a topic is needed for this pair."""
        return topic in self._always or bool(self._per_pair[topic].get_subscription_count())

    def publish_state(self) -> None:
        """Publish the current chain code and path, as after a reset."""
        self._schedule.restart()
        self._publish_due()

    def _publish_due(self) -> None:
        # A steady clock: a paused simulated time must not delay the last path.
        for topic in self._schedule.take(time.monotonic_ns()):
            self._of_all[topic].publish(MESSAGES.of_all(topic, self._estimator, self.parameters))
        # Each time the timer fires, rclpy checks all entities of the node, which takes time.
        if self._schedule.pending:
            self._timer.reset()
        else:
            self._timer.cancel()


def _publisher(node: Entities, topic: Topic) -> Publisher:
    return node.create_publisher(
        TYPES[topic.type], f'~/{topic.name}', LATCHED if topic.latched else PER_PAIR)
