# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Receives how the camera is mounted, from /tf_static."""

from collections.abc import Callable
from typing import Any

from phase_traj_ros.io.messages.mounting import Mount
from phase_traj_ros.io.messages.static_frames import STATIC_TOPIC, StaticFrames
from phase_traj_ros.ros.entities import Entities
from rclpy.qos import DurabilityPolicy, QoSProfile

# As tf2_ros subscribes: each publisher of /tf_static latches its own transforms.
_QOS = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class MountInput:
    """
    Subscribes to /tf_static, and passes on the place of the camera on the vehicle.

    TFMessage is read directly, as tf2_ros adds nothing to it here. Without tf2_msgs there is no
    transform to receive.
    """

    def __init__(self, entities: Entities, base_frame: str, on_mount: Callable[[], bool]) -> None:
        """
        Subscribe; call ``on_mount`` after each look at a known mount.

        It returns whether the node starts anew. ``base_frame`` is the frame of the vehicle.
        """
        self._base_frame = base_frame
        self.newest: Mount | None = None
        """The newest mount; None if it is unknown."""
        self._on_mount = on_mount
        self._camera = ''
        self._frames = StaticFrames()
        try:
            from tf2_msgs.msg import TFMessage
        except ImportError:
            return
        entities.create_subscription(TFMessage, STATIC_TOPIC, self.add, _QOS)

    def seen_by(self, camera_frame: str) -> bool:
        """Record the frame of the images; return whether the node starts anew."""
        if camera_frame == self._camera:
            return False
        self._camera = camera_frame
        return self.look()

    def add(self, message: Any) -> None:
        """Add the transforms of a tf2_msgs/TFMessage."""
        self._frames.add(message)
        self.look()

    def look(self) -> bool:
        """Look up the mount; return whether the node starts anew."""
        self.newest = None
        if self._camera:
            self.newest = self._frames.mount(self._base_frame, self._camera)
        return self.newest is not None and self._on_mount()
