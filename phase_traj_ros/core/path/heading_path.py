# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Draws the trajectory along the measured heading."""

import math
from typing import TypeAlias

from phase_traj_ros.core.path.thinning import Thinned
from phase_traj_ros.core.path.trajectory import ChainPath, Corner


class HeadingPath:
    """
    A path whose steps follow the heading half-way through each pair of frames.

    With ``max_corners``, the path is thinned as it grows. When it exceeds the limit, every second
    pose is dropped, and from then on every second pose is kept. The whole path remains, at a lower
    resolution.
    """

    def __init__(self, *, max_corners: int | None = None) -> None:
        """Make a path that has not started."""
        self._places: Thinned[Corner] = Thinned(max_corners)
        self._tip: Corner | None = None
        self._foreseen: Corner | None = None

    def start(self, stamp_ns: int) -> Corner:
        """Start at the origin, heading 0, unless the path has; return its measured pose."""
        if self._tip is None:
            self._tip = Corner(0.0, 0.0, 0.0, stamp_ns)
        return self._tip

    def append(self, heading: float, yaw: float, length: float, stamp_ns: int) -> Corner:
        """
        Append one step; return the pose at its end, which is that of a frame.

        ``heading`` is that at the end of the step in radians, positive to the left, not wrapped;
        ``yaw`` its change during the step; ``length`` is in the unit of the path, 0 changes the
        heading only.
        """
        if length != 0.0:
            # A standing vehicle must not displace earlier poses.
            self._places.offer(self.start(stamp_ns))
        self._tip = self.foresee(heading, yaw, length, stamp_ns)
        self._foreseen = None
        return self._tip

    def foresee(self, heading: float, yaw: float, length: float, stamp_ns: int) -> Corner:
        """Move the current pose by a step that the next one replaces; return it."""
        tip, middle = self.start(stamp_ns), heading - yaw / 2
        self._foreseen = Corner(
            tip.x + length * math.cos(middle), tip.y + length * math.sin(middle), heading,
            stamp_ns)
        return self._foreseen

    @property
    def tip(self) -> Corner | None:
        """Return the current pose, or None before the path has started."""
        return self._foreseen or self._tip

    @property
    def corners(self) -> tuple[Corner, ...]:
        """Return the kept poses, oldest first, without the tip."""
        return self._places.kept

    def points(self, limit: int) -> tuple[Corner, ...]:
        """Return poses of the whole path and the tip, at most ``limit`` (2 or more) in total."""
        if self.tip is None:
            return ()
        shown = self._places.kept
        while len(shown) > max(limit - 1, 1):
            shown = shown[::2]
        return (*shown, self.tip)


DrawnPath: TypeAlias = ChainPath | HeadingPath
"""A drawn trajectory, from codes or from the heading."""
