# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the node publishes, and when."""

from collections.abc import Callable
from typing import Any

from phase_traj_ros.core import TrajectoryEstimator, Update
from phase_traj_ros.io.messages.published import (
    ODOMETRY,
    pair_topics,
    PATH,
    Topic,
    whole_topics,
)
from phase_traj_ros.io.messages.schedule import Schedule
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.outputs.debug_image import DebugImage
from phase_traj_ros.ros.outputs.messages import MESSAGES, TYPES
from phase_traj_ros.ros.outputs.transform import TransformOutput
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions

# Reliable. Deep enough that a subscriber may fall a few seconds behind without losing a code.
_PER_PAIR = QoSProfile(depth=100)
# Whoever subscribes late gets the last one at once.
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# How often it is looked for news that had to wait, where no pair comes that does it.
_FLUSH_S = 0.25


class Outputs:
    """
    Publishes what each pair of frames adds.

    Codes, shift, response, status and pose go out with every pair, as far as anybody subscribes:
    nobody can have them later. The texts of the codes and the path go out when the schedule says
    so. A long path takes longer than the image it grows by: while nobody subscribes, it waits for
    the next subscriber.
    """

    def __init__(
        self, node: Node, estimator: TrajectoryEstimator, parameters: Parameters,
    ) -> None:
        """Make the publishers on ``node``."""
        self.parameters = parameters
        self._estimator = estimator
        topics = pair_topics(parameters)
        self._per_pair = {topic.name: _publisher(node, topic) for topic in topics}
        self._latched = {topic.name for topic in topics if topic.latched}
        self._of_all = {
            topic: _publisher(
                node, topic, on_match=self._on_path_match if topic is PATH else None)
            for topic in whole_topics(parameters)}
        self._path_waits = False
        self._debug_image = DebugImage(node, estimator)
        self._transform = TransformOutput(node) if parameters.publish_tf else None
        # Two poses in one frame would contradict each other: that in metres is the vehicle's.
        self._placed_by = ODOMETRY.name if parameters.metric else 'pose'
        self._schedule = Schedule(parameters)
        # A steady clock: under simulated time a paused one must not hold back the last path.
        self._clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(_FLUSH_S, self._publish_due, clock=self._clock)

    def publish(self, frame: StampedFrame, update: Update) -> None:
        """Publish what one pair of frames adds; ``frame`` is the second of them."""
        for topic, message in MESSAGES.of_pair(update, self.parameters, self._is_wanted):
            self._per_pair[topic].publish(message)
            if self._transform is not None and topic == self._placed_by:
                stamped = message.pose if topic == ODOMETRY.name else message
                self._transform.publish(
                    message.header, stamped.pose, self.parameters.child_frame_id)
        self._debug_image.publish(
            frame, update, MESSAGES.header(update.stamp_ns, frame.frame_id))
        self._schedule.add(update)
        self._publish_due()

    def _is_wanted(self, topic: str) -> bool:
        """Tell whether anybody takes what is published on a topic of pairs."""
        if self._transform is not None and topic == self._placed_by:
            return True
        return topic in self._latched or bool(self._per_pair[topic].get_subscription_count())

    def publish_state(self) -> None:
        """Publish the chain code and the path as they are now, as after a reset."""
        self._schedule.restart()
        self._publish_due()

    def _publish_due(self) -> None:
        for topic in self._schedule.take(self._clock.now().nanoseconds):
            if topic == PATH and not self._of_all[PATH].get_subscription_count():
                self._path_waits = True
            else:
                self._send(topic)
        # Each time it fires, rclpy goes through all that the node has: that takes a while.
        if self._schedule.pending:
            self._timer.reset()
        else:
            self._timer.cancel()

    def _on_path_match(self, match: Any) -> None:
        # What has been sent, the middleware hands to who comes late.
        if self._path_waits and match.current_count_change > 0:
            self._send(PATH)

    def _send(self, topic: Topic) -> None:
        self._path_waits &= topic != PATH
        self._of_all[topic].publish(MESSAGES.of_all(topic, self._estimator, self.parameters))


def _publisher(
    node: Node, topic: Topic, *, on_match: Callable[[Any], None] | None = None,
) -> Publisher:
    return node.create_publisher(
        TYPES[topic.type], f'~/{topic.name}', _LATCHED if topic.latched else _PER_PAIR,
        # rclpy's own callbacks would have it go through two more entities per topic at each wait.
        event_callbacks=PublisherEventCallbacks(matched=on_match, use_default_callbacks=False),
        qos_overriding_options=QoSOverridingOptions.with_default_policies())
