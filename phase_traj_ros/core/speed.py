# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The way that a vehicle has gone between two frames, from speeds that come at other times."""

from bisect import bisect_right
import math

# A speed holds for this long, unless a newer one comes.
_HOLDS_NS = 1_000_000_000
_NANO = 1e9


class SpeedTrack:
    """
    The newest speeds of a vehicle, each of which holds until the next one.

    Speeds are in metres per second, negative in reverse; stamps are of the frames' clock.
    """

    def __init__(self) -> None:
        """Make a track without any speed."""
        self._stamps: list[int] = []
        self._speeds: list[float] = []

    def clear(self) -> None:
        """Forget all speeds."""
        self._stamps.clear()
        self._speeds.clear()

    def add(self, stamp_ns: int, speed: float) -> None:
        """
        Take one more speed; one whose stamp lies before the last one's starts anew.

        Raises
        ------
        ValueError
            The speed is not finite; nothing has changed.

        """
        if not math.isfinite(speed):
            raise ValueError(f'the speed is {speed}: give a finite number')
        if self._stamps and stamp_ns < self._stamps[-1]:
            self.clear()
        self._stamps.append(stamp_ns)
        self._speeds.append(speed)

    def distance(self, begin_ns: int, end_ns: int) -> float | None:
        """
        Return the metres gone from one stamp to a later one, and forget what was before them.

        Each speed holds until the next one, but for a second at most. The first one there is
        holds for what was before it, too. None where no speed holds for all of the time.
        """
        first = max(bisect_right(self._stamps, begin_ns) - 1, 0)
        del self._stamps[:first], self._speeds[:first]
        after = bisect_right(self._stamps, end_ns)
        if after == 0 or self._stamps[0] - begin_ns > _HOLDS_NS:
            return None
        way = 0.0
        for index in range(after):
            start = begin_ns if index == 0 else self._stamps[index]
            stop = self._stamps[index + 1] if index + 1 < after else end_ns
            if stop - self._stamps[index] > _HOLDS_NS:
                return None
            way += self._speeds[index] * (stop - start) / _NANO
        return way
