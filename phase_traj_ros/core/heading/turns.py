# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Detects turns in the heading, as a driver would count them, independent of the codes.

A turn is a bend (``bends``) of 60 degrees or more, of any length: the corner of a street, and a
long bend of a motorway.

Distances are in camera heights. If they are unknown, each second counts as 5 heights, a car at
30 km/h. So the frame rate and the speed have no effect. The definition uses headings and distances
only, so it applies to measured and to true headings.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
import math

from phase_traj_ros.core.heading.bends import Bend, BendDetector, PathPoint, quarter_turns
from phase_traj_ros.core.heading.tuning import TUNING


@dataclass(frozen=True, slots=True)
class Turn:
    """
    One turn. Angles are positive to the left (REP 103).

    start_frame, end_frame
        Numbers of the frames at which the turn starts and ends; the first frame is 0.
    start_ns, end_ns
        Their stamps in nanoseconds.
    angle_deg
        Change of the heading between the two frames.
    peak_rate_deg_s
        Yaw rate of the fastest pair of frames, without corrections of earlier pairs.
    """

    start_frame: int
    end_frame: int
    start_ns: int
    end_ns: int
    angle_deg: float
    peak_rate_deg_s: float

    @property
    def quarter_turns(self) -> int:
        """Return the angle in quarter turns, rounded, positive to the left."""
        return quarter_turns(self.angle_deg)

    @classmethod
    def of(cls, bend: Bend) -> 'Turn':
        """Return a bend as a turn."""
        first, end = bend.first, bend.end
        return cls(
            first.frame, end.frame, first.stamp_ns, end.stamp_ns, bend.angle, bend.peak_rate)


class TurnDetector:
    """Detects turns frame by frame."""

    def __init__(self, *, min_angle_deg: float = TUNING.turn_deg) -> None:
        """
        Make a detector that waits for its first frame.

        Raises
        ------
        ValueError
            The minimum angle is not a finite number above 0.

        """
        if not (math.isfinite(min_angle_deg) and min_angle_deg > 0):
            raise ValueError(f'min_angle_deg is {min_angle_deg}: give a finite number above 0')
        self._min_angle = min_angle_deg
        # Each side separately: a pair to the other side does not end a turn.
        self._sides = tuple(BendDetector(sign, min_angle_deg) for sign in (1, -1))
        self._last: PathPoint | None = None
        # Turns that have ended since the newest frame, by a cut or a correction.
        self._waiting: list[Turn] = []
        self._direction_quarters = 0
        self.quarters: tuple[int, ...] = ()
        """
        The quarter turns that count from the newest frame on: 1 to the left, -1 to the right.

        They are in the order in which their turns started. The quarters of a turn count from the
        frame at which it reaches the minimum angle. A turn in progress may add more of them later.
        Counted quarters are not revoked.
        """
        self._widest_deg = 0.0

    @property
    def widest_deg(self) -> float:
        """Return the angle of the widest bend so far, in degrees, 0 or more."""
        return max([self._widest_deg, *(
            abs(side.bend.angle) for side in self._sides if side.bend is not None)])

    @property
    def direction_error_deg(self) -> float:
        """
        Return the angle between the heading and the direction by the quarters, in degrees.

        It is 0 within a bend, whose quarters may still count.
        """
        bends = [side.bend for side in self._sides]
        if self._last is None or any(
                bend is not None and abs(bend.angle) >= TUNING.swerve_deg for bend in bends):
            return 0.0
        return abs(self._last.heading - 90.0 * self._direction_quarters)

    def update(
        self, stamp_ns: int, heading: float, distance: float | None = None, *,
        rate: float | None = None, frames: int = 1,
    ) -> list[Turn]:
        """
        Add the next frame; return the turns that have ended, a dip or more before it.

        ``heading`` is in radians, positive to the left, not wrapped. ``distance`` is that since
        the previous frame, in camera heights, 0 or more, None if unknown. ``rate`` is the yaw rate
        in radians per second, None if the heading has no corrections of earlier frames.
        ``frames`` is the number of this frame minus that of the previous one.
        """
        before = self._last
        if before is None:
            self._last = PathPoint(0, stamp_ns, math.degrees(heading), 0.0)
            return []
        seconds = (stamp_ns - before.stamp_ns) * 1e-9
        distance = TUNING.usual_speed * seconds if distance is None else distance
        travelled = max(distance, TUNING.min_speed * seconds)
        self._last = PathPoint(
            before.frame + frames, stamp_ns, math.degrees(heading), before.distance + travelled)
        rate_deg = None if rate is None else math.degrees(rate)
        ended = [side.update(before, self._last, rate_deg) for side in self._sides]
        for bend in filter(None, ended):
            self._widest_deg = max(self._widest_deg, abs(bend.angle))
        counted = [count for side in self._sides for count in side.take_quarters()]
        self.quarters = tuple(side for _, side in sorted(counted, key=lambda count: count[0]))
        self._direction_quarters += sum(self.quarters)
        turns, self._waiting = [*self._waiting, *self._turns(ended)], []
        return turns

    def cut(self) -> None:
        """End the turns in progress, for the next update: its pair shows another scene."""
        self._widest_deg = self.widest_deg
        self._waiting += self._turns(side.cut() for side in self._sides)

    def scale(self, factor: float) -> None:
        """
        Multiply all headings so far by a factor, to correct them.

        A bend that becomes a turn is returned by the next update. Turns that were returned before
        do not change.
        """
        if self._last is not None:
            self._last = self._last.scaled(factor)
        self._widest_deg *= factor
        for side in self._sides:
            self._waiting += self._turns(side.scale(factor))

    def finish(self) -> list[Turn]:
        """Return the turns that end with the newest frame, which is the last one."""
        self.cut()
        turns, self._waiting = self._waiting, []
        return turns

    def _turns(self, ended: Iterable[Bend | None]) -> list[Turn]:
        """Return the bends that are turns."""
        return [
            Turn.of(bend) for bend in ended
            if bend is not None and abs(bend.angle) >= self._min_angle]


def find_turns(
    stamps_ns: Iterable[int], headings: Iterable[float], ways: Sequence[float] | None = None, *,
    min_angle_deg: float = TUNING.turn_deg,
) -> list[Turn]:
    """
    Return all turns of a drive, in the order in which they start.

    Parameters
    ----------
    stamps_ns
        Stamps of the frames, increasing.
    headings
        Headings at the frames in radians, positive to the left, not wrapped.
    ways
        Ways to the frames, in heights of the camera above the road, not decreasing; None if they
        are unknown.
    min_angle_deg
        Minimum angle of a turn.

    """
    detector, turns = TurnDetector(min_angle_deg=min_angle_deg), []
    for number, (stamp_ns, heading) in enumerate(zip(stamps_ns, headings)):
        distance = None if ways is None or number == 0 else ways[number] - ways[number - 1]
        turns += detector.update(stamp_ns, heading, distance)
    return sorted([*turns, *detector.finish()], key=lambda turn: turn.start_frame)
