# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The trajectory along the measured heading, rather than along the quantised direction."""

import math

from phase_traj_ros.core.trajectory import Corner


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
        if max_corners is not None and max_corners < 1:
            raise ValueError(f'max_corners is {max_corners}: give at least 1')
        self._max_corners = max_corners
        self._corners: list[Corner] = []
        self.reset()

    def reset(self) -> None:
        """Go back to the origin and forget the path."""
        self._corners.clear()
        self._tip: Corner | None = None
        # Every so many steps are kept, and so many have been made.
        self._every = 1
        self._steps = 0

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
        if self._steps % self._every == 0:
            self._keep(tip)
        self._steps += 1
        middle = heading - yaw / 2
        self._tip = Corner(
            tip.x + length * math.cos(middle), tip.y + length * math.sin(middle), heading,
            stamp_ns)

    def _keep(self, place: Corner) -> None:
        self._corners.append(place)
        if self._max_corners is not None and len(self._corners) > self._max_corners:
            del self._corners[1::2]
            self._every *= 2

    @property
    def tip(self) -> Corner | None:
        """Return where the path has got to, or None before it has started."""
        return self._tip

    @property
    def corners(self) -> tuple[Corner, ...]:
        """Return the places kept, oldest first, without the tip."""
        return tuple(self._corners)

    def points(self, limit: int) -> tuple[Corner, ...]:
        """Return places of the whole way and the tip, at most ``limit`` (2 or more) in all."""
        if self._tip is None:
            return ()
        every = 1
        while -(-len(self._corners) // every) > limit - 1:
            every *= 2
        return (*self._corners[::every], self._tip)
