# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Draws the trajectory along the measured heading."""

import math

from phase_traj_ros.core.path.thinning import Thinned
from phase_traj_ros.core.path.trajectory import Corner


class HeadingPath:
    """
    A path whose steps follow the heading half-way through each pair of frames.

    With ``max_corners``, the path is thinned as it grows. When it exceeds the limit, every second
    pose is dropped, and from then on every second pose is kept. The whole way remains, at a lower
    resolution.
    """

    def __init__(self, *, max_corners: int | None = None) -> None:
        """
        Make a path that has not started.

        Raises
        ------
        ValueError
            ``max_corners`` is below 1.

        """
        self._places: Thinned[Corner] = Thinned(max_corners)
        self.reset()

    def reset(self) -> None:
        """Go back to the origin and forget the path."""
        self._places.clear()
        self._tip: Corner | None = None
        self._foreseen: Corner | None = None

    def start(self, stamp_ns: int) -> None:
        """Start at the origin, heading 0; on a path that has started, do nothing."""
        if self._tip is None:
            self._tip = Corner(0.0, 0.0, 0.0, stamp_ns)

    def append(self, heading: float, yaw: float, length: float, stamp_ns: int) -> None:
        """
        Append one step.

        Parameters
        ----------
        heading
            Heading at the end of the step in radians, positive to the left, not wrapped.
        yaw
            Change of the heading during the step.
        length
            Length of the step in the unit of the path; 0 changes the heading only.
        stamp_ns
            Stamp of the frame at the end of the step.

        """
        self.start(stamp_ns)
        assert self._tip is not None
        if length != 0.0:
            # A standing vehicle must not displace earlier poses.
            self._places.offer(self._tip)
        self.foresee(heading, yaw, length, stamp_ns)
        self._tip, self._foreseen = self._foreseen, None

    def foresee(self, heading: float, yaw: float, length: float, stamp_ns: int) -> None:
        """Move the current pose by a step that the next one replaces."""
        self.start(stamp_ns)
        tip = self._tip
        assert tip is not None
        middle = heading - yaw / 2
        self._foreseen = Corner(
            tip.x + length * math.cos(middle), tip.y + length * math.sin(middle), heading,
            stamp_ns)

    @property
    def tip(self) -> Corner | None:
        """Return the current pose, or None before the path has started."""
        return self._foreseen or self._tip

    @property
    def corners(self) -> tuple[Corner, ...]:
        """Return the kept poses, oldest first, without the tip."""
        return self._places.kept

    def points(self, limit: int) -> tuple[Corner, ...]:
        """Return poses of the whole way and the tip, at most ``limit`` (2 or more) in total."""
        if self.tip is None:
            return ()
        shown: Thinned[Corner] = Thinned(limit - 1)
        for place in self._places.kept:
            shown.offer(place)
        return (*shown.kept, self.tip)
