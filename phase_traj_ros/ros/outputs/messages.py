# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Makes the messages of the node from the ROS message classes."""

from importlib import import_module
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from phase_traj_ros.io.messages.published import Messages


def _status(*, level: int, **fields: Any) -> DiagnosticStatus:
    """Make a status; rclpy represents its level as a byte."""
    return DiagnosticStatus(level=bytes([level]), **fields)


class _Types(dict[str, Any]):
    """Constructors of the messages by the names of their types, imported at the first use."""

    def __missing__(self, name: str) -> Any:
        package, _, kind = name.split('/')
        self[name] = getattr(import_module(f'{package}.msg'), kind)
        return self[name]


TYPES = _Types({'diagnostic_msgs/msg/DiagnosticStatus': _status})
MESSAGES = Messages(TYPES)


def to_time(stamp_ns: int) -> Any:
    """Return a stamp in nanoseconds as a builtin_interfaces/Time."""
    return MESSAGES.time(stamp_ns)
