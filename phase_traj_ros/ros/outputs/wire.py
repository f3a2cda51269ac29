# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Serialises the path, the only message with many parts.

rclpy publishes bytes as they are. Converting a path of 1000 poses pose by pose takes many times as
long as measuring a pair of frames. The format is CDR, little-endian (OMG DDS-XTypes 1.3, 7.4.3).
"""

from collections.abc import Sequence
import math
import struct

import numpy as np
from phase_traj_ros.core import Corner

_LITTLE_ENDIAN = b'\x00\x01\x00\x00'
_NANOSECONDS = 10**9


class _Writer:
    """Bytes of a message; alignment is relative to the end of the first four."""

    def __init__(self) -> None:
        self._data = bytearray(_LITTLE_ENDIAN)

    def add(self, form: str, *values: float) -> None:
        """Add values of one size; ``form`` is that of struct."""
        self._align(struct.calcsize(f'<{form[-1]}'))
        self._data += struct.pack(f'<{form}', *values)

    def add_text(self, text: str) -> None:
        content = text.encode() + b'\0'
        self.add('I', len(content))
        self._data += content

    def add_header(self, stamp_ns: int, frame_id: str) -> None:
        self.add('i', stamp_ns // _NANOSECONDS)
        self.add('I', stamp_ns % _NANOSECONDS)
        self.add_text(frame_id)

    def with_rest(self, rest: bytes) -> bytes:
        return b''.join((self._data, rest))

    def _align(self, size: int) -> None:
        self._data += bytes(-(len(self._data) - len(_LITTLE_ENDIAN)) % size)


def path_bytes(points: Sequence[Corner], stamp_ns: int, frame_id: str) -> bytes:
    """Return a nav_msgs/Path with these poses, serialised."""
    writer = _Writer()
    writer.add_header(stamp_ns, frame_id)
    writer.add('I', len(points))
    if not points:
        return writer.with_rest(b'')
    first, rest = points[0], points[1:]
    writer.add_header(first.stamp_ns, frame_id)
    writer.add('7d', *_pose(first))
    # A pose ends at a multiple of eight, so all that follow have the same layout.
    name = frame_id.encode() + b'\0'
    text = struct.pack('<I', len(name)) + name
    text += bytes(-(8 + len(text)) % 8)
    poses = np.empty(len(rest), np.dtype([
        ('stamp', '<u4', 2), ('text', f'V{len(text)}'), ('pose', '<f8', 7)]))
    poses['stamp'] = [divmod(each.stamp_ns, _NANOSECONDS) for each in rest] or 0
    poses['text'] = np.void(text)
    poses['pose'] = [_pose(each) for each in rest] or 0
    return writer.with_rest(poses.tobytes())


def _pose(corner: Corner) -> tuple[float, ...]:
    """Return position and orientation of a pose, the fields of a geometry_msgs/Pose."""
    half = corner.yaw / 2
    return corner.x, corner.y, 0.0, 0.0, 0.0, math.sin(half), math.cos(half)
