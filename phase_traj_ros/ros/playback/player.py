# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishes recorded frames on ROS topics, with their stamps and a clock."""

from collections.abc import Iterable
from threading import Event
import time

from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.errors import OutputError
from phase_traj_ros.io.messages.camera_info import camera_info_fields
from phase_traj_ros.io.messages.stamps import STAMPS_END_NS
from phase_traj_ros.io.sources.base import CAMERA_FRAME, StampedFrame
from phase_traj_ros.ros.outputs.messages import MESSAGES
from phase_traj_ros.ros.playback.matching import wait_until_known
from phase_traj_ros.topics import camera_info_topic
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import HistoryPolicy, qos_profile_sensor_data, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

PLAYER_NAME = 'phase_traj_player'
LOSSLESS = QoSProfile(
    history=HistoryPolicy.KEEP_ALL, depth=1, reliability=ReliabilityPolicy.RELIABLE)
_POLL_S = 0.05
_ACKNOWLEDGE_S = 30
# An extreme rate exceeds the longest timeout of an event.
_LONGEST_WAIT_S = 1e9
# A stamp that is later than the previous one by more than this is wrong, or follows a break.
_LONGEST_PAUSE_NS = 60 * 10**9


class FramePlayer(Node):
    """
    Publishes frames as mono8, mono16 or 32FC1 images on ``topic``.

    If the calibration of the camera is known, it is published with each image on ``camera_info``.
    Another thread has to spin the node (``spinning``).
    """

    def __init__(
        self, *, topic: str = 'image', lossless: bool = False, camera: CameraModel | None = None,
        rectified: CameraModel | None = None, clock_hz: float | None = None,
    ) -> None:
        """
        Make the publishers.

        Parameters
        ----------
        topic
            Name of the image topic.
        lossless
            Whether the images are reliable and KEEP_ALL; otherwise they are sensor data.
        camera
            Camera model of the images.
        rectified
            Camera model of the rectified images.
        clock_hz
            Rate at which the time of the recording is published on /clock. None leaves /clock to
            others: every node of the system with ``use_sim_time`` follows it.

        """
        super().__init__(PLAYER_NAME)
        self._lossless = lossless
        qos = LOSSLESS if lossless else qos_profile_sensor_data
        self._images = self.create_publisher(Image, topic, qos)
        self.topic = str(self._images.topic_name)
        """Full name of the topic of the images."""
        self._calibrations: Publisher | None = None
        if camera is not None:
            self._camera = camera_info_fields(camera, rectified=rectified)
            self._calibrations = self.create_publisher(
                CameraInfo, camera_info_topic(self.topic), qos)
        self._clock_publisher: Publisher | None = None
        self._tick_s = _LONGEST_WAIT_S
        if clock_hz is not None:
            self._clock_publisher = self.create_publisher(Clock, '/clock', QoSProfile(depth=10))
            self._tick_s = 1.0 / clock_hz

    def wait_for_subscribers(self, stop: Event, timeout_s: float) -> bool:
        """
        Wait until a subscriber of the images has discovered this player, or ``stop`` is set.

        Return False if no subscriber with a matching quality of service appears within
        ``timeout_s`` seconds.
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
        Publish ``frames`` at ``rate`` times their recorded speed; return their number.

        The timing restarts if a stamp goes back, such as from one loop to the next, or jumps by
        more than a minute, of which it warns.

        Raises
        ------
        OutputError
            A message cannot hold the stamp of a frame.

        """
        published = 0
        if self._calibrations is not None and self._lossless:
            # A node that is known by now has the camera before the first image.
            self._publish_camera(Header(frame_id=CAMERA_FRAME))
            self._wait_until_acknowledged(self._calibrations, stop)
        began, first_ns, previous_ns = time.monotonic(), 0, None
        for frame in frames:
            if not -STAMPS_END_NS <= frame.stamp_ns < STAMPS_END_NS:
                raise OutputError(
                    f'a message cannot hold the stamp {frame.stamp_ns / 1e9:.9f} s: stamps must be'
                    ' from -2**31 to 2**31 seconds; give --fps')
            step_ns = -1 if previous_ns is None else frame.stamp_ns - previous_ns
            if step_ns > _LONGEST_PAUSE_NS:
                self.get_logger().warning(
                    f'the stamp of frame {published} is {step_ns / 1e9:.0f} s later than the one'
                    ' before: the pause is not played')
            if not 0 <= step_ns <= _LONGEST_PAUSE_NS:
                began, first_ns = time.monotonic(), frame.stamp_ns
            previous_ns = frame.stamp_ns
            due = began + (frame.stamp_ns - first_ns) / 1e9 / rate
            if self._wait(due, stop, frame.stamp_ns, rate):
                break
            self._publish(frame)
            published += 1
        return published

    def wait_for_acknowledgement(self, stop: Event) -> None:
        """
        Wait until every subscriber has received all lossless images, or ``stop`` is set.

        Raises
        ------
        OutputError
            A subscriber has not acknowledged all images within half a minute.

        """
        if not self._wait_until_acknowledged(self._images, stop) and not stop.is_set():
            raise OutputError(
                f'a subscriber of {self.topic} has not acknowledged all frames'
                f' within {_ACKNOWLEDGE_S} s')

    def _wait_until_acknowledged(self, publisher: Publisher, stop: Event) -> bool:
        """Return whether all messages arrive within half a minute, before ``stop`` is set."""
        deadline = time.monotonic() + _ACKNOWLEDGE_S
        # No other thread runs, and no signal is seen, while rclpy waits.
        while not publisher.wait_for_all_acked(Duration(seconds=_POLL_S)):
            if time.monotonic() >= deadline or stop.wait(_POLL_S):
                return False
        return True

    def _wait(self, due: float, stop: Event, stamp_ns: int, rate: float) -> bool:
        """Wait until ``due``, the time of a stamp; return whether ``stop`` is set."""
        while (left := due - time.monotonic()) > self._tick_s:
            if stop.wait(self._tick_s):
                return True
            self._tick(stamp_ns - round(left * 1e9 * rate))
        return stop.wait(max(left, 0.0))

    def _publish(self, frame: StampedFrame) -> None:
        header = MESSAGES.header(frame.stamp_ns, frame.frame_id)
        self._tick(frame.stamp_ns)
        self._publish_camera(header)
        self._images.publish(MESSAGES.image(frame.image, header))

    def _tick(self, stamp_ns: int) -> None:
        if self._clock_publisher is not None:
            self._clock_publisher.publish(Clock(clock=MESSAGES.time(stamp_ns)))

    def _publish_camera(self, header: Header) -> None:
        if self._calibrations is not None:
            self._calibrations.publish(CameraInfo(header=header, **self._camera))
