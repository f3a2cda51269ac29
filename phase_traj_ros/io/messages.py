# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
From the estimator's values to ROS messages, whoever made the message classes.

Those of rclpy and those of rosbags take the same fields by keyword, so that what the node
publishes and what a bag written offline holds come from the same lines.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any, Final

from phase_traj_ros.core import ChainCode, ChainPath, Corner, Shift, Update, yaw
from phase_traj_ros.core.chain_text import describe
from phase_traj_ros.parameters import Parameters

CHAIN_CODE_PERIOD_NS: Final = 10**9
"""The chain code's text goes out when the movement changes, else at most this often."""

_NANOSECONDS = 10**9


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic that the node publishes; its name is relative to the node's."""

    name: str
    type: str  # noqa: A003
    latched: bool = False
    """Whether who subscribes late gets the last message at once."""


PER_PAIR: Final = (
    Topic('movement', 'std_msgs/msg/UInt8'),
    Topic('direction', 'std_msgs/msg/UInt8'),
    Topic('shift', 'geometry_msgs/msg/Vector3Stamped'),
    Topic('response', 'std_msgs/msg/Float32'),
    Topic('status', 'std_msgs/msg/String'),
    Topic('pose', 'geometry_msgs/msg/PoseStamped'),
)
"""What ``Messages.of_pair`` makes messages for."""

HEADING: Final = (
    Topic('heading', 'std_msgs/msg/Float64'),
    Topic('heading_stamped', 'geometry_msgs/msg/QuaternionStamped'),
    Topic('turn', 'geometry_msgs/msg/Vector3Stamped'),
)
"""What it makes them for where the heading is measured, too."""

CHAIN_CODE: Final = Topic('chain_code', 'std_msgs/msg/String', latched=True)
PATH: Final = Topic('path', 'nav_msgs/msg/Path', latched=True)
DEBUG_IMAGE: Final = Topic('debug_image', 'sensor_msgs/msg/Image')


def pair_topics(parameters: Parameters) -> tuple[Topic, ...]:
    """Return the topics that ``Messages.of_pair`` makes messages for with these parameters."""
    return (*PER_PAIR, *HEADING) if parameters.measures_heading else PER_PAIR


class Messages:
    """Makes messages of the classes given; pure functions of their arguments."""

    def __init__(self, types: Mapping[str, Callable[..., Any]]) -> None:
        """
        Use the classes ``types``, by names such as ``std_msgs/msg/Header``.

        Parameters
        ----------
        types
            What builtin_interfaces, std_msgs, geometry_msgs and nav_msgs define, as far as it is
            asked for.

        """
        self._types = types

    def time(self, stamp_ns: int) -> Any:
        """Return a stamp given in nanoseconds as a builtin_interfaces/Time."""
        seconds, nanoseconds = divmod(stamp_ns, _NANOSECONDS)
        return self._types['builtin_interfaces/msg/Time'](sec=seconds, nanosec=nanoseconds)

    def header(self, stamp_ns: int, frame_id: str) -> Any:
        """Return a std_msgs/Header."""
        return self._types['std_msgs/msg/Header'](stamp=self.time(stamp_ns), frame_id=frame_id)

    def of_pair(self, update: Update, parameters: Parameters) -> Iterator[tuple[str, Any]]:
        """Yield the names of topics and the messages that go out with a pair, see PER_PAIR."""
        types, step = self._types, update.step
        header = self.header(update.stamp_ns, parameters.frame_id)
        yield 'movement', types['std_msgs/msg/UInt8'](data=int(step.movement))
        if step.appended:
            yield 'direction', types['std_msgs/msg/UInt8'](data=int(step.direction))
        yield 'shift', self.shift(update.shift, header)
        response = 0.0 if update.shift is None else update.shift.response
        yield 'response', types['std_msgs/msg/Float32'](data=response)
        yield 'status', types['std_msgs/msg/String'](data=update.status.value)
        yield 'pose', self.pose(update.tip, parameters.step_length, header)
        if update.heading is not None:
            yield 'heading', types['std_msgs/msg/Float64'](data=update.heading.heading)
            yield 'heading_stamped', types['geometry_msgs/msg/QuaternionStamped'](
                header=header, quaternion=self._yaw(update.heading.heading))
        for turn in update.turns:
            yield 'turn', types['geometry_msgs/msg/Vector3Stamped'](
                header=self.header(turn.end_ns, parameters.frame_id),
                vector=types['geometry_msgs/msg/Vector3'](
                    x=0.0, y=0.0, z=math.radians(turn.angle_deg)))

    def shift(self, shift: Shift | None, header: Any) -> Any:
        """Return the raw shift in pixels; NaN where the two frames cannot be compared."""
        dx, dy = (math.nan, math.nan) if shift is None else (shift.dx, shift.dy)
        return self._types['geometry_msgs/msg/Vector3Stamped'](
            header=header, vector=self._types['geometry_msgs/msg/Vector3'](x=dx, y=dy, z=0.0))

    def pose(self, corner: Corner, step_length: float, header: Any) -> Any:
        """Return a corner of the path as a PoseStamped, in steps of ``step_length`` metres."""
        types = self._types
        return types['geometry_msgs/msg/PoseStamped'](
            header=header,
            pose=types['geometry_msgs/msg/Pose'](
                position=types['geometry_msgs/msg/Point'](
                    x=corner.x * step_length, y=corner.y * step_length, z=0.0),
                orientation=self._yaw(yaw(corner.heading))))

    def _yaw(self, angle: float) -> Any:
        """Return a rotation about the vertical axis, in radians, as a Quaternion."""
        return self._types['geometry_msgs/msg/Quaternion'](
            x=0.0, y=0.0, z=math.sin(angle / 2), w=math.cos(angle / 2))

    def path(self, points: Sequence[Corner], step_length: float, header: Any) -> Any:
        """Return a nav_msgs/Path of corner points, see ``path_points``."""
        return self._types['nav_msgs/msg/Path'](header=header, poses=[
            self.pose(point, step_length, self.header(point.stamp_ns, header.frame_id))
            for point in points
        ])

    def chain_code(
        self, codes: ChainCode, frames: int, parameters: Parameters,
    ) -> Any:
        """Return both codes as text, in a std_msgs/String."""
        text = describe(codes, frames=frames, max_runs=parameters.chain_code_runs)
        return self._types['std_msgs/msg/String'](data=str(text))


def path_points(path: ChainPath, limit: int) -> tuple[Corner, ...]:
    """Return the newest corner points of a path and its tip, at most ``limit`` in all."""
    corners, tip = path.corners, path.tip
    return () if tip is None else (*corners[max(len(corners) - limit + 1, 0):], tip)
