# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishes recorded frames on real topics, with their stamps and a clock."""

from array import array
from collections.abc import Iterable
from threading import Event
import time

import numpy as np
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.errors import OutputError
from phase_traj_ros.io.messages.camera_info import camera_info_fields
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.ros.outputs.messages import to_time
from phase_traj_ros.ros.playback.matching import wait_until_known
from phase_traj_ros.topics import camera_info_topic
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, qos_profile_sensor_data, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

PLAYER_NAME = 'phase_traj_player'
LOSSLESS = QoSProfile(
    history=HistoryPolicy.KEEP_ALL, depth=1, reliability=ReliabilityPolicy.RELIABLE)
_POLL_S = 0.05
_ACKNOWLEDGE_S = 30
_LATER_S = 1.0
_LONGEST_WAIT_S = 1e9


class FramePlayer(Node):
    """
    Publishes frames as mono8 or mono16 images on ``topic``, and their stamps on /clock.

    Where the camera's calibration is known, it goes out with each image on ``camera_info`` beside.
    """

    def __init__(
        self, *, topic: str = 'image', lossless: bool = False, camera: CameraModel | None = None,
        rectified: CameraModel | None = None,
    ) -> None:
        """
        Make the publishers.

        Parameters
        ----------
        topic
            Of the images.
        lossless
            Reliable and KEEP_ALL, else as sensor data.
        camera
            Model of the camera for the images as they are.
        rectified
            The same if they are rectified ones.

        """
        super().__init__(PLAYER_NAME)
        self._lossless = lossless
        qos = LOSSLESS if lossless else qos_profile_sensor_data
        self._images = self.create_publisher(Image, topic, qos)
        self._camera = None
        if camera is not None:
            self._camera = camera_info_fields(camera, rectified=rectified)
        if self._camera is not None:
            self._calibrations = self.create_publisher(
                CameraInfo, camera_info_topic(self._images.topic_name), qos)
        self._clock_publisher = self.create_publisher(Clock, '/clock', QoSProfile(depth=10))

    @property
    def topic(self) -> str:
        """Return the full name of the topic of the images."""
        return str(self._images.topic_name)

    def wait_for_subscribers(self, stop: Event, timeout_s: float) -> bool:
        """
        Return when somebody listens and knows this player, or when ``stop`` is set.

        Tell whether somebody does, with a matching quality of service, within the time.
        """
        deadline = time.monotonic() + timeout_s
        while self._images.get_subscription_count() == 0:
            if time.monotonic() >= deadline:
                return False
            if stop.wait(_POLL_S):
                return True
        wait_until_known(self, self.topic, stop)
        return True

    def play(self, frames: Iterable[StampedFrame], stop: Event, *, rate: float = 1.0) -> int:
        """
        Publish ``frames`` at ``rate`` times their own pace; return how many were published.

        The pace starts anew where stamps go backwards, as from one loop to the next.
        """
        published = 0
        self._introduce_camera(stop)
        began, first_ns, previous_ns = time.monotonic(), 0, None
        for frame in frames:
            if previous_ns is None or frame.stamp_ns < previous_ns:
                began, first_ns = time.monotonic(), frame.stamp_ns
            previous_ns = frame.stamp_ns
            due = began + (frame.stamp_ns - first_ns) / 1e9 / rate
            # Whoever plays a pause of centuries, or a rate of next to nothing, waits for ever.
            if stop.wait(min(max(due - time.monotonic(), 0.0), _LONGEST_WAIT_S)):
                break
            self._publish(frame)
            published += 1
        return published

    def wait_for_acknowledgement(self) -> None:
        """
        Return when every subscriber has received everything; at once unless lossless.

        Raises
        ------
        OutputError
            One has not, within half a minute.

        """
        if self._lossless and not self._images.wait_for_all_acked(
                Duration(seconds=_ACKNOWLEDGE_S)):
            raise OutputError(
                f'a subscriber of {self._images.topic_name} has not acknowledged all frames'
                f' within {_ACKNOWLEDGE_S} s')

    def _introduce_camera(self, stop: Event) -> None:
        """Let who wants the calibration have it before the first image, if nothing may be lost."""
        if self._camera is None or not self._lossless:
            return
        # Whoever has subscribed to the images may be a moment later here, or not at all.
        deadline = time.monotonic() + _LATER_S
        while (self._calibrations.get_subscription_count() == 0
                and time.monotonic() < deadline and not stop.wait(_POLL_S)):
            pass
        self._calibrations.publish(CameraInfo(header=Header(frame_id='camera'), **self._camera))
        self._calibrations.wait_for_all_acked(Duration(seconds=_ACKNOWLEDGE_S))

    def _publish(self, frame: StampedFrame) -> None:
        stamp = to_time(frame.stamp_ns)
        self._clock_publisher.publish(Clock(clock=stamp))
        header = Header(stamp=stamp, frame_id='camera')
        if self._camera is not None:
            self._calibrations.publish(CameraInfo(header=header, **self._camera))
        self._images.publish(image_message(frame.image, header))


def image_message(image: np.ndarray, header: Header) -> Image:
    """Return a grey (H, W) image, uint8 or uint16, as a message."""
    wide = image.dtype == np.uint16
    little = np.ascontiguousarray(image, dtype='<u2' if wide else np.uint8)
    data = array('B')
    data.frombytes(little.data.cast('B'))
    height, width = image.shape
    return Image(
        header=header, height=height, width=width, encoding='mono16' if wide else 'mono8',
        is_bigendian=0, step=width * little.itemsize, data=data)
