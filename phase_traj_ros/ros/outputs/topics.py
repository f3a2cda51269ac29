# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the node publishes, and when."""

from typing import Any

from phase_traj_ros.core import Movement, TrajectoryEstimator, Update
from phase_traj_ros.io.messages.pacing import Pace
from phase_traj_ros.io.messages.published import (
    CHAIN_CODE,
    CHAIN_CODE_PERIOD_NS,
    ODOMETRY,
    pair_topics,
    PATH,
    Topic,
)
from phase_traj_ros.io.sources.base import Frame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.outputs.debug_image import DebugImage
from phase_traj_ros.ros.outputs.messages import MESSAGES, TYPES
from phase_traj_ros.ros.outputs.transform import TransformOutput
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions

# Reliable. Deep enough that a subscriber may fall a few seconds behind without losing a code.
_PER_PAIR = QoSProfile(depth=100)
# Whoever subscribes late gets the last one at once.
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Outputs:
    """
    Publishes what each pair of frames adds.

    Codes, shift, response, status and pose go out with every pair. The chain code's text goes out
    when the movement changes, else at most once a second; the path at most at ``path_rate``, and
    both only when there is news.
    """

    def __init__(
        self, node: Node, estimator: TrajectoryEstimator, parameters: Parameters,
    ) -> None:
        """Make the publishers on ``node``."""
        self.parameters = parameters
        self._estimator = estimator
        self._per_pair = {
            topic.name: _publisher(node, topic, _PER_PAIR) for topic in pair_topics(parameters)}
        self._chain_code = _publisher(node, CHAIN_CODE, _LATCHED)
        self._path = _publisher(node, PATH, _LATCHED)
        self._debug_image = DebugImage(node, estimator)
        self._transform = TransformOutput(node) if parameters.publish_tf else None
        # Two poses in one frame would contradict each other: that in metres is the vehicle's.
        self._placed_by = ODOMETRY.name if parameters.metric else 'pose'
        self._last_movement: Movement | None = None
        self._text = Pace(CHAIN_CODE_PERIOD_NS)
        self._path_pending = False
        # Steady clocks: under simulated time a paused clock must not hold back the last path.
        self._clock = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(0.1, self._flush_text, clock=self._clock)
        node.create_timer(1.0 / parameters.path_rate, self._flush_path, clock=self._clock)

    def publish(self, frame: Frame, update: Update) -> None:
        """Publish what one pair of frames adds; ``frame`` is the second of them."""
        for topic, message in MESSAGES.of_pair(update, self.parameters):
            self._per_pair[topic].publish(message)
            if self._transform is not None and topic == self._placed_by:
                stamped = message.pose if topic == ODOMETRY.name else message
                self._transform.publish(
                    message.header, stamped.pose, self.parameters.child_frame_id)
        self._debug_image.publish(
            frame, update, MESSAGES.header(update.stamp_ns, frame.frame_id))
        self._text.changed()
        self._path_pending = True
        if update.step.movement is not self._last_movement:
            self._last_movement = update.step.movement
            self._publish_text()

    def publish_state(self) -> None:
        """Publish the chain code and the path as they are now, as after a reset."""
        self._last_movement = None
        self._publish_text()
        self._publish_path()

    def _flush_text(self) -> None:
        if self._text.is_due(self._clock.now().nanoseconds):
            self._publish_text()

    def _flush_path(self) -> None:
        if self._path_pending:
            self._publish_path()

    def _publish_text(self) -> None:
        self._chain_code.publish(MESSAGES.chain_code(
            self._estimator.codes, self._estimator.frames, self.parameters))
        self._text.sent(self._clock.now().nanoseconds)

    def _publish_path(self) -> None:
        points = self._estimator.path.points(self.parameters.max_path_poses)
        header = self._header(self._estimator.last_stamp_ns or 0)
        self._path.publish(MESSAGES.path(points, self.parameters.path_scale, header))
        self._path_pending = False

    def _header(self, stamp_ns: int) -> Any:
        return MESSAGES.header(stamp_ns, self.parameters.frame_id)


def _publisher(node: Node, topic: Topic, qos: QoSProfile) -> Publisher:
    return node.create_publisher(
        TYPES[topic.type], f'~/{topic.name}', qos,
        qos_overriding_options=QoSOverridingOptions.with_default_policies())
