# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the node publishes, and when."""

from geometry_msgs.msg import PoseStamped, Vector3Stamped
from nav_msgs.msg import Path
from phase_traj_ros.core import Movement, TrajectoryEstimator, Update
from phase_traj_ros.core.chain_text import describe
from phase_traj_ros.io.source import Frame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.debug_image import DebugImage
from phase_traj_ros.ros.messages import path_message, pose_message, shift_message, to_time
from phase_traj_ros.ros.transform import TransformOutput
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from std_msgs.msg import Float32, Header, String, UInt8

# Reliable. Deep enough that a subscriber may fall a few seconds behind without losing a code.
_PER_PAIR = QoSProfile(depth=100)
# Whoever subscribes late gets the last one at once.
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_CHAIN_CODE_PERIOD_NS = 10**9


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
        self._movement = _publisher(node, UInt8, '~/movement', _PER_PAIR)
        self._direction = _publisher(node, UInt8, '~/direction', _PER_PAIR)
        self._shift = _publisher(node, Vector3Stamped, '~/shift', _PER_PAIR)
        self._response = _publisher(node, Float32, '~/response', _PER_PAIR)
        self._status = _publisher(node, String, '~/status', _PER_PAIR)
        self._pose = _publisher(node, PoseStamped, '~/pose', _PER_PAIR)
        self._chain_code = _publisher(node, String, '~/chain_code', _LATCHED)
        self._path = _publisher(node, Path, '~/path', _LATCHED)
        self._debug_image = DebugImage(node, estimator)
        self._transform = TransformOutput(node) if parameters.publish_tf else None
        self._last_movement: Movement | None = None
        self._text_pending = self._path_pending = False
        # Steady clocks: under simulated time a paused clock must not hold back the last path.
        self._clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._text_due_ns = 0
        node.create_timer(0.1, self._flush_text, clock=self._clock)
        node.create_timer(1.0 / parameters.path_rate, self._flush_path, clock=self._clock)

    def publish(self, frame: Frame, update: Update) -> None:
        """Publish what one pair of frames adds; ``frame`` is the second of them."""
        header = self._header(update.stamp_ns)
        self._movement.publish(UInt8(data=int(update.step.movement)))
        if update.step.appended:
            self._direction.publish(UInt8(data=int(update.step.direction)))
        self._shift.publish(shift_message(update.shift, header))
        response = 0.0 if update.shift is None else update.shift.response
        self._response.publish(Float32(data=response))
        self._status.publish(String(data=update.status.value))
        pose = pose_message(update.tip, self.parameters.step_length, header)
        self._pose.publish(pose)
        if self._transform is not None:
            self._transform.publish(pose, self.parameters.child_frame_id)
        self._debug_image.publish(frame, update, header)
        self._text_pending = self._path_pending = True
        if update.step.movement is not self._last_movement:
            self._last_movement = update.step.movement
            self._publish_text()

    def publish_state(self) -> None:
        """Publish the chain code and the path as they are now, as after a reset."""
        self._last_movement = None
        self._publish_text()
        self._publish_path()

    def _flush_text(self) -> None:
        if self._text_pending and self._clock.now().nanoseconds >= self._text_due_ns:
            self._publish_text()

    def _flush_path(self) -> None:
        if self._path_pending:
            self._publish_path()

    def _publish_text(self) -> None:
        text = describe(
            self._estimator.codes, frames=self._estimator.frames,
            max_runs=self.parameters.chain_code_runs)
        self._chain_code.publish(String(data=str(text)))
        self._text_pending = False
        self._text_due_ns = self._clock.now().nanoseconds + _CHAIN_CODE_PERIOD_NS

    def _publish_path(self) -> None:
        header = self._header(self._estimator.last_stamp_ns or 0)
        self._path.publish(
            path_message(self._estimator.path, self.parameters.step_length, header))
        self._path_pending = False

    def _header(self, stamp_ns: int) -> Header:
        return Header(stamp=to_time(stamp_ns), frame_id=self.parameters.frame_id)


def _publisher(node: Node, message: type, topic: str, qos: QoSProfile) -> Publisher:
    return node.create_publisher(
        message, topic, qos, qos_overriding_options=QoSOverridingOptions.with_default_policies())
