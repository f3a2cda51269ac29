# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the node publishes, and when."""

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
# How often a path goes out that nobody subscribes to.
_UNWATCHED_PATH_NS = 5 * 10**9


class Outputs:
    """
    Publishes what each pair of frames adds.

    Codes, shift, response, status and pose go out with every pair, as far as anybody subscribes:
    nobody can have them later. The texts of the codes and the path go out when the schedule says
    so. A long path takes longer to send than an image to correlate: while nobody subscribes, it
    goes out now and then only, for late subscribers.
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
        self._of_all = {topic: _publisher(node, topic) for topic in whole_topics(parameters)}
        self._path_waits = False
        self._path_sent_ns: int | None = None
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
        # Late subscribers must not get the path from before.
        self._path_sent_ns = None
        self._publish_due()

    def _publish_due(self) -> None:
        now_ns = self._clock.now().nanoseconds
        for topic in self._schedule.take(now_ns):
            if topic == PATH:
                self._path_waits = True
            else:
                self._send(topic)
        if self._path_waits and self._is_path_wanted(now_ns):
            self._path_waits = False
            self._path_sent_ns = now_ns
            self._send(PATH)
        # Each time it fires, rclpy goes through all that the node has: that takes a while.
        if self._schedule.pending or self._path_waits:
            self._timer.reset()
        else:
            self._timer.cancel()

    def _is_path_wanted(self, now_ns: int) -> bool:
        if self._path_sent_ns is None or now_ns - self._path_sent_ns >= _UNWATCHED_PATH_NS:
            return True
        return bool(self._of_all[PATH].get_subscription_count())

    def _send(self, topic: Topic) -> None:
        self._of_all[topic].publish(MESSAGES.of_all(topic, self._estimator, self.parameters))


def _publisher(node: Node, topic: Topic) -> Publisher:
    return node.create_publisher(
        TYPES[topic.type], f'~/{topic.name}', _LATCHED if topic.latched else _PER_PAIR,
        # rclpy's own callbacks would have it go through two more entities per topic at each wait.
        event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        qos_overriding_options=QoSOverridingOptions.with_default_policies())
