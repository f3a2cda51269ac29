# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The trajectory along the measured heading, rather than along the quantised direction."""

import math

from phase_traj_ros.core.path.thinning import Thinned
from phase_traj_ros.core.path.trajectory import Corner


class HeadingPath:
    """
    A path whose every step goes along the heading half-way through the pair of frames.

    With ``max_corners`` it is thinned as it grows: whenever it would hold more places, every other
    one is dropped, and from then on every other one is kept. So the whole way stays, ever coarser.
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

    def start(self, stamp_ns: int) -> None:
        """Start at the origin, heading 0; on a path that has started, do nothing."""
        if self._tip is None:
            self._tip = Corner(0.0, 0.0, 0.0, stamp_ns)

    def append(self, heading: float, yaw: float, length: float, stamp_ns: int) -> None:
        """
        Go one step of ``length``.

        Parameters
        ----------
        heading
            At the end of the step, in radians, left positive, not wrapped.
        yaw
            By how much it has changed during the step.
        length
            In whatever unit the path has; 0 turns on the spot.
        stamp_ns
            Of the frame at its end.

        """
        self.start(stamp_ns)
        tip = self._tip
        assert tip is not None
        if length != 0.0:
            # Standing still must not push out where the vehicle has been.
            self._places.offer(tip)
        middle = heading - yaw / 2
        self._tip = Corner(
            tip.x + length * math.cos(middle), tip.y + length * math.sin(middle), heading,
            stamp_ns)

    @property
    def tip(self) -> Corner | None:
        """Return where the path has got to, or None before it has started."""
        return self._tip

    @property
    def corners(self) -> tuple[Corner, ...]:
        """Return the places kept, oldest first, without the tip."""
        return self._places.kept

    def points(self, limit: int) -> tuple[Corner, ...]:
        """Return places of the whole way and the tip, at most ``limit`` (2 or more) in all."""
        if self._tip is None:
            return ()
        shown: Thinned[Corner] = Thinned(limit - 1)
        for place in self._places.kept:
            shown.offer(place)
        return (*shown.kept, self._tip)
