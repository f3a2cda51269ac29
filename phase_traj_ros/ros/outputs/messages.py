# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Makes the messages of the node from the ROS message classes."""

from array import array
from collections import ChainMap
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Corner
from phase_traj_ros.io.messages.published import Messages
from phase_traj_ros.ros.outputs.wire import path_bytes
from sensor_msgs.msg import Image


def _status(*, level: int, **fields: Any) -> DiagnosticStatus:
    """Make a status; rclpy represents its level as a byte."""
    return DiagnosticStatus(level=bytes([level]), **fields)


def _image(*, data: NDArray[np.uint8], **fields: Any) -> Image:
    """Make an image; rclpy converts any other data than an array byte by byte."""
    samples = array('B')
    samples.frombytes(data.data)
    return Image(data=samples, **fields)


class _Types(dict[str, Any]):
    """The classes of messages by the names of their types, imported at the first use."""

    def __missing__(self, name: str) -> Any:
        package, _, kind = name.split('/')
        self[name] = getattr(import_module(f'{package}.msg'), kind)
        return self[name]


class _NodeMessages(Messages):
    """The messages of the node; its path, with up to a thousand poses, is serialised already."""

    def path(self, points: Sequence[Corner], header: Any) -> Any:
        """Return a nav_msgs/Path in bytes."""
        return path_bytes(super().path(points[:1], header), points)


TYPES = _Types()
MESSAGES = _NodeMessages(ChainMap({
    'diagnostic_msgs/msg/DiagnosticStatus': _status, 'sensor_msgs/msg/Image': _image}, TYPES))
