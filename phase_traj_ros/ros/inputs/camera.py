# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Receives the camera's calibration."""

from collections.abc import Callable

from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.errors import CalibrationError
from phase_traj_ros.io.messages.camera_info import camera_from_info
from phase_traj_ros.ros.entities import Entities
from phase_traj_ros.ros.inputs.image import IMAGE_TOPIC
from phase_traj_ros.topics import camera_info_topic
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo

_TOPIC = 'camera_info'
# What image_proc calls them.
_RECTIFIED = 'image_rect'
_THROTTLE_S = 5.0


class CameraInput:
    """
    Subscribes to ``camera_info`` and passes on each changed calibration.

    The topic is next to the image topic, as in image_transport, unless it is remapped.
    """

    def __init__(
        self, node: Node, entities: Entities, *, rectified: bool,
        on_camera: Callable[[CameraModel], None],
    ) -> None:
        """Subscribe; pass each new calibration to ``on_camera``."""
        self._node = node
        self._rectified = rectified
        self._on_camera = on_camera
        self._camera: CameraModel | None = None
        images = node.resolve_topic_name(IMAGE_TOPIC)
        topic = node.resolve_topic_name(_TOPIC)
        if topic == node.resolve_topic_name(_TOPIC, only_expand=True):
            topic = camera_info_topic(images)
        if not rectified and images.rpartition('/')[2].startswith(_RECTIFIED):
            node.get_logger().warning(
                f'{images} looks like rectified images, of which the calibration would remove the'
                ' distortion a second time: set rectified, if they are')
        self.topic = str(entities.create_subscription(
            CameraInfo, topic, self._on_message, qos_profile_sensor_data).topic_name)
        """Full name of the topic after remapping."""

    @property
    def missing(self) -> str:
        """Return why no image can be used yet; empty once a calibration has arrived."""
        return '' if self._camera else (
            f'the focal length is unknown, as no calibration has arrived on {self.topic} yet:'
            ' publish it there, or set focal_px or hfov_deg')

    def _on_message(self, message: CameraInfo) -> None:
        try:
            camera = camera_from_info(message, rectified=self._rectified)
        except CalibrationError as error:
            self._node.get_logger().error(
                f'skipped a calibration on {self.topic}: {error}',
                throttle_duration_sec=_THROTTLE_S)
            return
        if self._camera is not None and camera.is_close_to(self._camera):
            return
        told = (
            f'calibration from {self.topic}: {camera.width}x{camera.height} pixels, focal length'
            f' {camera.fx:.1f} px')
        if self._camera is None:
            self._node.get_logger().info(told)
        else:
            # The calibration of a zoom lens may change with every image.
            self._node.get_logger().info(f'new {told}', throttle_duration_sec=_THROTTLE_S)
        self._camera = camera
        self._on_camera(camera)
