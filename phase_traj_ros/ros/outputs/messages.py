# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Makes the messages of the node from the ROS message classes."""

from array import array
from collections import ChainMap
from collections.abc import Sequence
from importlib import import_module
import math
import struct
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Path
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Corner
from phase_traj_ros.io.messages.published import Messages
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Image

# Bytes before the characters of the frame: representation, stamp and length.
_FRAME = 4 + 8 + 4


def _status(*, level: int, **fields: Any) -> DiagnosticStatus:
    """Make a status; rclpy represents its level as a byte."""
    return DiagnosticStatus(level=bytes([level]), **fields)


def _image(*, data: NDArray[np.uint8], **fields: Any) -> Image:
    """Make an image; rclpy converts any other data than an array byte by byte."""
    samples = array('B')
    samples.frombytes(data.data)
    return Image(data=samples, **fields)


def path_bytes(start: Path, points: Sequence[Corner]) -> bytes:
    """
    Return a nav_msgs/Path with these poses, serialised; ``start`` has the first one only.

    rclpy publishes bytes as they are. Converting a path of 1000 poses pose by pose takes many
    times as long as measuring a pair of frames. The format is CDR (OMG DDS-XTypes 1.3, 7.4.3).
    """
    message = bytearray(serialize_message(start))
    if len(points) < 2:
        return bytes(message)
    name = start.header.frame_id.encode() + b'\0'
    # The number of poses follows the frame, aligned to four bytes.
    struct.pack_into('=I', message, _FRAME + len(name) + -len(name) % 4, len(points))
    # A pose ends at a multiple of eight, so all that follow have the same layout.
    text = struct.pack('=I', len(name)) + name
    text += bytes(-(8 + len(text)) % 8)
    rest = points[1:]
    poses = np.empty(len(rest), np.dtype([
        ('stamp', 'i4', 2), ('text', f'V{len(text)}'), ('pose', 'f8', 7)]))
    poses['stamp'] = [divmod(each.stamp_ns, 10**9) for each in rest]
    poses['text'] = np.void(text)
    poses['pose'] = [
        (each.x, each.y, 0.0, 0.0, 0.0, math.sin(each.yaw / 2), math.cos(each.yaw / 2))
        for each in rest]
    return bytes(message) + poses.tobytes()


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
