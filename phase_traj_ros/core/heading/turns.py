# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Detects turns in the heading, as a driver would count them, independent of the codes.

A bend is a part of the way in which the heading changes steadily to one side, and a turn is a bend
of 60 degrees or more, of any length: the corner of a street, and a long bend of a motorway. It is
found with a cumulative sum (Page, "Continuous inspection schemes", 1954): of the change of the
heading, less what it would be in the gentlest bend. A bend starts where this sum is lowest, and
ends where it is highest. A straight, or a bend to the other side, that is longer than a dip ends
it. A dip is shorter than the way in which the bend itself turns by 10 degrees.

The way is in heights of the camera. Where it is unknown, each second counts as 5 heights, which a
car travels at 30 km/h. So neither the frame rate nor the speed makes a difference. The definition
uses headings and ways only, so it applies to measured and to true headings.
"""

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
import math

MIN_ANGLE_DEG = 60.0
# The gentlest bend, in degrees per height of the camera: a radius of 1.9 km with one at 1.65 m.
# Straight roads, and the drift of the heading on them, are well below.
_GENTLEST = 0.05
# Length of a dip in degrees that the bend would turn meanwhile, and its limits in heights. Between
# two corners there is more than 4 m of straight road.
_DIP_DEG, _SHORTEST_DIP, _LONGEST_DIP = 10.0, 2.5, 30.0
# A change to the side of the bend that ends a dip; the heading on a straight varies by less.
_ON_DEG = 1.0
# Heights per second where the way is unknown, and at least, as a turn ends some time after a stop.
_USUAL_SPEED, _LEAST_SPEED = 5.0, 0.02
# A bend of less is a swerve: the vehicle drives straight on, and it is not kept.
_SWERVE_DEG = 5.0
# Number of bends that are kept, in case all headings are corrected by a factor later.
_KEPT = 20


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
        Yaw rate of the fastest pair of frames.
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
        return int(math.copysign(math.floor(abs(self.angle_deg) / 90 + 0.5), self.angle_deg))


@dataclass(frozen=True, slots=True)
class _Place:
    """A frame: its heading in degrees, and the way to it in heights of the camera."""

    frame: int
    stamp_ns: int
    heading: float
    way: float

    def score(self, sign: int) -> float:
        """Return the cumulative sum here, for bends to one side."""
        return sign * self.heading - _GENTLEST * self.way

    def scaled(self, factor: float) -> '_Place':
        """Return the place with its heading multiplied by a factor."""
        return replace(self, heading=factor * self.heading)


class TurnDetector:
    """
    Detects turns frame by frame.

    It stores only the two ends of a turn, so its memory does not grow with the length of the turn.
    """

    def __init__(self, *, min_angle_deg: float = MIN_ANGLE_DEG) -> None:
        """
        Make a detector that waits for its first frame.

        Raises
        ------
        ValueError
            The minimum angle is not a finite number above 0.

        """
        if not (math.isfinite(min_angle_deg) and min_angle_deg > 0):
            raise ValueError(
                f'min_angle_deg is {min_angle_deg}: give a finite number above 0')
        self._min_angle = min_angle_deg
        # Each side separately: a pair to the other side does not end a turn.
        self._sides = tuple(_Side(sign, min_angle_deg) for sign in (1, -1))
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next frame is the first."""
        for side in self._sides:
            side.forget()
        self._last: _Place | None = None
        self._quarters: tuple[int, ...] = ()
        self._coded = 0
        self._bends: tuple[Turn, ...] = ()

    @property
    def quarters(self) -> tuple[int, ...]:
        """
        Return the quarter turns that count from the newest frame on: 1 to the left, -1 to right.

        They are in the order in which their turns started. The quarters of a turn count from the
        frame at which it reaches the minimum angle. A turn in progress may add more of them later.
        Counted quarters are not revoked.
        """
        return self._quarters

    @property
    def bends(self) -> tuple[Turn, ...]:
        """Return the bends of any angle whose end was detected with the newest frame."""
        return self._bends

    @property
    def aside_deg(self) -> float:
        """
        Return the angle between the heading and the direction that the quarters give, in degrees.

        It is 0 within a bend, whose quarters may yet count.
        """
        if self._last is None or any(side.angle_deg >= _SWERVE_DEG for side in self._sides):
            return 0.0
        return abs(self._last.heading - 90.0 * self._coded)

    def update(
        self, stamp_ns: int, heading: float, way: float | None = None, *, frames: int = 1,
    ) -> list[Turn]:
        """
        Add the next frame; return the turns that have ended, a dip or more before it.

        Parameters
        ----------
        stamp_ns
            Stamp of the frame, later than the previous one.
        heading
            Heading at this frame in radians, positive to the left, not wrapped.
        way
            Way since the previous frame, in heights of the camera above the road, 0 or more; None
            if it is unknown.
        frames
            Number of this frame minus that of the previous one.

        """
        before = self._last
        if before is None:
            self._last = _Place(0, stamp_ns, math.degrees(heading), 0.0)
            return []
        seconds = (stamp_ns - before.stamp_ns) * 1e-9
        gone = max(_USUAL_SPEED * seconds if way is None else way, _LEAST_SPEED * seconds)
        self._last = _Place(
            before.frame + frames, stamp_ns, math.degrees(heading), before.way + gone)
        late = [turn for side in self._sides for turn in side.take_late()]
        ended = [side.update(before, self._last) for side in self._sides]
        self._bends = tuple(bend for bend in ended if bend is not None)
        counted = sorted(
            (count for side in self._sides for count in side.take_counted()),
            key=lambda count: count[0])
        self._quarters = tuple(quarter for _, quarter in counted)
        self._coded += sum(self._quarters)
        return self._large_enough([*late, *self._bends])

    def cut(self) -> list[Turn]:
        """End and return the turns in progress: the next pair shows another scene."""
        return self._large_enough([side.cut() for side in self._sides])

    def scale(self, factor: float) -> None:
        """
        Multiply all headings so far by a factor, to correct them.

        A bend that becomes a turn is returned by the next update. Turns that were returned before
        do not change.
        """
        if self._last is not None:
            self._last = self._last.scaled(factor)
        for side in self._sides:
            side.scale(factor)

    def finish(self) -> list[Turn]:
        """Return the turn in progress if it has reached the minimum angle; forget everything."""
        found = [turn for side in self._sides for turn in (*side.late, side.cut())]
        self.reset()
        return self._large_enough(found)

    def _large_enough(self, ended: Iterable[Turn | None]) -> list[Turn]:
        return [
            turn for turn in ended if turn is not None and abs(turn.angle_deg) >= self._min_angle]


def find_turns(
    stamps_ns: Iterable[int], headings: Iterable[float], ways: Sequence[float] | None = None, *,
    min_angle_deg: float = MIN_ANGLE_DEG,
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
        way = None if ways is None or number == 0 else ways[number] - ways[number - 1]
        turns += detector.update(stamp_ns, heading, way)
    return sorted([*turns, *detector.finish()], key=lambda turn: turn.start_frame)


class _Side:
    """The bends in which the vehicle yaws to one side."""

    def __init__(self, sign: int, min_angle: float) -> None:
        self._sign = sign
        self._min_angle = min_angle
        # The newest bends that have ended, each with the number of its counted quarters.
        self._ended: deque[tuple[Turn, int]] = deque(maxlen=_KEPT)
        # Where the bend in progress, or the next one, starts, and its end so far.
        self._first: _Place | None = None
        self._end: _Place | None = None
        # Its fastest pair, where it turned last, and the lowest score since.
        self._peak = self._turned_at = self._lowest = 0.0
        # Number of its counted quarters.
        self._counted = 0
        self.forget()

    def forget(self) -> None:
        self._ended.clear()
        self.late: list[Turn] = []
        self._new: list[tuple[int, int]] = []
        self._restart(None)

    @property
    def angle_deg(self) -> float:
        """Return the angle of the bend in progress, 0 or more."""
        if self._first is None or self._end is None:
            return 0.0
        return self._sign * (self._end.heading - self._first.heading)

    def update(self, before: _Place, after: _Place) -> Turn | None:
        """Add a pair of frames; return the bend that has ended before it."""
        ended = self.cut() if self._is_over(before) else None
        if self._first is None:
            self._restart(before)
        assert self._first is not None
        score = after.score(self._sign)
        if score <= self._first.score(self._sign):
            # As long as no quarter counts; that of a turn is not revoked.
            ended = ended or self.cut()
            self._restart(after)
            return ended
        rate = (after.heading - before.heading) / (after.stamp_ns - before.stamp_ns) * 1e9
        self._peak = max(self._peak, self._sign * rate)
        self._lowest = min(self._lowest, score)
        if self._end is None or score > self._end.score(self._sign):
            self._end = after
        if score > self._lowest + _ON_DEG:
            self._lowest, self._turned_at = score, after.way
        self._counted = self._count(self._turn(), self._counted)
        return ended

    def take_counted(self) -> list[tuple[int, int]]:
        """Return start frame and side of each newly counted quarter."""
        new, self._new = self._new, []
        return new

    def take_late(self) -> list[Turn]:
        late, self.late = self.late, []
        return late

    def scale(self, factor: float) -> None:
        for _ in range(len(self._ended)):
            before, counted = self._ended.popleft()
            after = replace(
                before, angle_deg=before.angle_deg * factor,
                peak_rate_deg_s=before.peak_rate_deg_s * factor)
            if abs(before.angle_deg) < self._min_angle <= abs(after.angle_deg):
                self.late.append(after)
            self._ended.append((after, self._count(after, counted)))
        self._first = None if self._first is None else self._first.scaled(factor)
        self._end = None if self._end is None else self._end.scaled(factor)
        self._peak *= factor
        # The turn may end with the next frame.
        self._counted = self._count(self._turn(), self._counted)

    def cut(self) -> Turn | None:
        """End the bend in progress; return it."""
        turn = self._turn()
        if turn is not None and abs(turn.angle_deg) >= _SWERVE_DEG:
            self._ended.append((turn, self._counted))
        self._restart(None)
        return turn

    def _restart(self, first: _Place | None) -> None:
        """Look for a bend that starts here, or at the next frame."""
        self._first, self._end = first, None
        self._peak, self._counted = 0.0, 0
        self._turned_at = 0.0 if first is None else first.way
        self._lowest = math.inf if first is None else first.score(self._sign)

    def _turn(self) -> Turn | None:
        first, end = self._first, self._end
        if first is None or end is None:
            return None
        return Turn(
            first.frame, end.frame, first.stamp_ns, end.stamp_ns, end.heading - first.heading,
            self._sign * self._peak)

    def _is_over(self, place: _Place) -> bool:
        """Return whether the way since the end of the bend, up to a place, is more than a dip."""
        if self._first is None or self._end is None:
            return False
        way = self._end.way - self._first.way
        dip = min(max(_DIP_DEG * way / self.angle_deg, _SHORTEST_DIP), _LONGEST_DIP)
        return place.way - self._turned_at > dip

    def _count(self, turn: Turn | None, counted: int) -> int:
        """Count the new quarters of a turn; return the number of all its counted quarters."""
        if turn is None or abs(turn.angle_deg) < self._min_angle:
            return counted
        further = turn.quarter_turns - counted
        if further * self._sign <= 0:
            return counted
        self._new += [(turn.start_frame, self._sign)] * abs(further)
        return turn.quarter_turns
