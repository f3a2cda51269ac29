# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Integrates speeds to the distance travelled between two frames."""

from bisect import bisect_right

from phase_traj_ros.core.path.tuning import TUNING

MAX_SPEED = 1000.0
"""Largest valid speed in metres per second."""


def is_speed(speed: float) -> bool:
    """Return whether a number, in metres per second, is a valid speed; NaN is not."""
    return abs(speed) <= MAX_SPEED


class SpeedTrack:
    """
    Speeds of a vehicle, each of which is valid until the next one.

    Speeds are in metres per second, negative in reverse. Stamps are by the clock of the frames.
    """

    def __init__(self, *, max_speeds: int | None = None) -> None:
        """Make a track that keeps at least the newest ``max_speeds``; None keeps all."""
        self._max_speeds = max_speeds
        self._stamps: list[int] = []
        self._speeds: list[float] = []

    def add(self, stamp_ns: int, speed: float) -> None:
        """
        Add a speed; a stamp before the previous one discards all earlier speeds.

        Raises
        ------
        ValueError
            The speed is not from -1000 to 1000. The state is unchanged.

        """
        if not is_speed(speed):
            raise ValueError(
                f'the speed is {speed}: give metres per second from {-MAX_SPEED:g} to'
                f' {MAX_SPEED:g}')
        if self._stamps and stamp_ns < self._stamps[-1]:
            self._stamps.clear()
            self._speeds.clear()
        self._stamps.append(stamp_ns)
        self._speeds.append(speed)
        if self._max_speeds is not None and len(self._stamps) > 2 * self._max_speeds:
            del self._stamps[:-self._max_speeds], self._speeds[:-self._max_speeds]

    @property
    def newest_ns(self) -> int | None:
        """Return the stamp of the newest speed, None if there is none."""
        return self._stamps[-1] if self._stamps else None

    def distance(self, begin_ns: int, end_ns: int) -> float | None:
        """
        Return the distance in metres between two stamps; None if it is not covered by speeds.

        Each speed is valid until the next one, at most for 2.5 seconds. The first speed is also
        valid for up to 2.5 seconds before it.
        """
        first = max(bisect_right(self._stamps, begin_ns) - 1, 0)
        after = bisect_right(self._stamps, end_ns)
        stamps, speeds = self._stamps[first:after], self._speeds[first:after]
        if not stamps or stamps[0] - begin_ns > TUNING.max_speed_age_ns:
            return None
        ends = [*stamps[1:], end_ns]
        if any(end - stamp > TUNING.max_speed_age_ns for stamp, end in zip(stamps, ends)):
            return None
        begins = [begin_ns, *stamps[1:]]
        return sum(speed * (end - begin) / 1e9 for speed, begin, end in zip(speeds, begins, ends))
