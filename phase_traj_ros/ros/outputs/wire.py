# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Serialises the path, the only message with many parts.

rclpy publishes bytes as they are. Converting a path of 1000 poses pose by pose takes many times as
long as measuring a pair of frames. The format is CDR (OMG DDS-XTypes 1.3, 7.4.3).
"""

from collections.abc import Sequence
import math
import struct

from nav_msgs.msg import Path
import numpy as np
from phase_traj_ros.core import Corner
from rclpy.serialization import serialize_message

# Bytes before the characters of the frame: representation, stamp and length.
_FRAME = 4 + 8 + 4


def path_bytes(start: Path, points: Sequence[Corner]) -> bytes:
    """Return a nav_msgs/Path with these poses, serialised; ``start`` has the first one only."""
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
