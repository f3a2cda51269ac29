# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Receives raw or compressed images, and passes on frames for the correlation."""

from collections.abc import Callable, Mapping
import time
from typing import Any

from phase_traj_ros.errors import FrameError
from phase_traj_ros.io.messages.image import encoding_of, msg_to_frame
from phase_traj_ros.io.messages.stamps import StampRule, to_nanoseconds
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.ros.entities import Entities
from phase_traj_ros.ros.graph import COMPRESSED, RAW, SUFFIX
from phase_traj_ros.ros.health import Health, LossCounter, Stage
from phase_traj_ros.ros.outputs.messages import TYPES
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data

IMAGE_TOPIC = 'image'
_THROTTLE_S = 5.0


def image_topic(node: Node, parameters: Parameters) -> str:
    """Return the full name of the image topic after remapping."""
    # The name is resolved first, so that a remapping of image also applies to compressed images.
    suffix = SUFFIX if _is_compressed(parameters) else ''
    return str(node.resolve_topic_name(IMAGE_TOPIC)) + suffix


class ImageInput:
    """
    Subscribes to the camera and converts its messages to frames.

    The topic is ``image``, or ``image/compressed`` for compressed images, as in image_transport.
    """

    def __init__(
        self, node: Node, entities: Entities, parameters: Parameters, health: Health,
        *, on_frame: Callable[[StampedFrame], None], on_undecodable: Callable[[], None],
    ) -> None:
        """
        Subscribe; pass each frame to ``on_frame``, which may raise FrameError.

        Call ``on_undecodable`` for an image that cannot be converted to a frame.
        """
        self._node = node
        self._health = health
        self._on_frame = on_frame
        self._on_undecodable = on_undecodable
        self._stamps = StampRule()
        self._losses = LossCounter(lambda: node.count_publishers(self.topic))
        self.message_type = COMPRESSED if _is_compressed(parameters) else RAW
        subscription = entities.create_subscription(
            TYPES[self.message_type], image_topic(node, parameters), self._on_message,
            qos_profile_sensor_data)
        self.topic = str(subscription.topic_name)
        """Full name of the topic after remapping."""
        self.qos_profile = subscription.qos_profile
        """Quality of service of the subscription, with its overrides."""

    def _on_message(self, message: Any, info: Mapping[str, Any]) -> None:
        self._health.arrived(
            time.monotonic_ns(), lost=self._losses.update(info['publication_sequence_number']),
            size=len(message.data))
        waited_ns = time.time_ns() - info['received_timestamp']
        began = time.perf_counter_ns()
        stamp_ns = self._stamps.stamp_ns(
            to_nanoseconds(message.header.stamp), self._node.get_clock().now().nanoseconds)
        try:
            image = msg_to_frame(message)
            # Nobody else has this message, so the estimator need not copy its data.
            image.flags.writeable = False
        except FrameError as error:
            self._on_undecodable()
            self._reject(error)
            return
        converted = time.perf_counter_ns()
        try:
            self._on_frame(StampedFrame(
                image, stamp_ns, encoding_of(message), message.header.frame_id))
        except FrameError as error:
            self._reject(error)
            return
        waited_ns = max(waited_ns, 0) if info['received_timestamp'] else 0
        self._health.took(Stage.RECEIVE, waited_ns)
        self._health.took(Stage.CONVERT, converted - began)
        self._health.took_in_all(waited_ns + time.perf_counter_ns() - began)

    def _reject(self, error: FrameError) -> None:
        self._health.rejected(str(error))
        self._node.get_logger().error(
            f'skipped an image on {self.topic}: {error}', throttle_duration_sec=_THROTTLE_S)


def _is_compressed(parameters: Parameters) -> bool:
    return parameters.image_transport == 'compressed'
