# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Detects turns in the heading, as a driver would count them, independent of the codes.

A turn is a period in which the vehicle yaws at more than 5 degrees per second to one side, and by
60 degrees or more in total. It starts with the first such pair of frames and ends with the last
one. Dips of the yaw rate of up to half a second belong to the turn, whether they are real or
measurement errors. A turn of any angle is one turn. The definition uses headings and stamps only,
so it applies to measured and to true headings.
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, replace
import math

MIN_RATE_DEG_S = 5.0
MIN_ANGLE_DEG = 60.0
LONGEST_DIP_NS = 500_000_000
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


class TurnDetector:
    """
    Detects turns frame by frame.

    It stores only the two ends of a turn, so its memory does not grow with the length of the turn.
    """

    def __init__(
        self, *, min_rate_deg_s: float = MIN_RATE_DEG_S, min_angle_deg: float = MIN_ANGLE_DEG,
    ) -> None:
        """
        Make a detector that waits for its first frame.

        Raises
        ------
        ValueError
            The minimum rate or the minimum angle is not a finite number above 0.

        """
        for name, value in (('min_rate_deg_s', min_rate_deg_s), ('min_angle_deg', min_angle_deg)):
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f'{name} is {value}: give a finite number above 0')
        self._min_angle = min_angle_deg
        # Each side separately: a pair to the other side does not end a turn.
        self._sides = tuple(
            _Side(sign, min_rate_deg_s, min_angle_deg) for sign in (1, -1))
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next frame is the first."""
        for side in self._sides:
            side.forget()
        self._frame = -1
        self._last: tuple[int, float] | None = None
        self._quarters: tuple[int, ...] = ()

    @property
    def quarters(self) -> tuple[int, ...]:
        """
        Return the quarter turns that count from the newest frame on: 1 to the left, -1 to right.

        They are in the order in which their turns started. The quarters of a turn count from the
        frame at which it reaches the minimum angle. A turn in progress may add more of them later.
        Counted quarters are not revoked.
        """
        return self._quarters

    def update(self, stamp_ns: int, heading: float) -> list[Turn]:
        """
        Add the next frame; return the turns that have ended, half a second or more before it.

        Parameters
        ----------
        stamp_ns
            Stamp of the frame, later than the previous one.
        heading
            Heading at this frame in radians, positive to the left, not wrapped.

        """
        self._frame += 1
        last, self._last = self._last, (stamp_ns, math.degrees(heading))
        if last is None:
            return []
        ended = self._large_enough(
            turn for side in self._sides
            for turn in (*side.take_late(), side.update(self._frame, last, self._last)))
        counted = sorted(
            (count for side in self._sides for count in side.take_counted()),
            key=lambda count: count[0])
        self._quarters = tuple(quarter for _, quarter in counted)
        return ended

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
            self._last = (self._last[0], self._last[1] * factor)
        for side in self._sides:
            side.scale(factor)

    def finish(self) -> list[Turn]:
        """Return the turn in progress if it has reached the minimum angle; forget everything."""
        found = [turn for side in self._sides for turn in (*side.late, side.turn)]
        self.reset()
        return self._large_enough(found)

    def _large_enough(self, ended: Iterable[Turn | None]) -> list[Turn]:
        return [
            turn for turn in ended if turn is not None and abs(turn.angle_deg) >= self._min_angle]


def find_turns(
    stamps_ns: Iterable[int], headings: Iterable[float], *,
    min_rate_deg_s: float = MIN_RATE_DEG_S, min_angle_deg: float = MIN_ANGLE_DEG,
) -> list[Turn]:
    """
    Return all turns of a drive, in the order in which they start.

    Parameters
    ----------
    stamps_ns
        Stamps of the frames, increasing.
    headings
        Headings at the frames in radians, positive to the left, not wrapped.
    min_rate_deg_s, min_angle_deg
        Minimum yaw rate and minimum angle of a turn.

    """
    detector = TurnDetector(min_rate_deg_s=min_rate_deg_s, min_angle_deg=min_angle_deg)
    turns = [
        turn for stamp_ns, heading in zip(stamps_ns, headings)
        for turn in detector.update(stamp_ns, heading)]
    return sorted([*turns, *detector.finish()], key=lambda turn: turn.start_frame)


class _Side:
    """The bends in which the vehicle yaws to one side."""

    def __init__(self, sign: int, min_rate: float, min_angle: float) -> None:
        self._sign = sign
        self._min_rate = min_rate
        self._min_angle = min_angle
        # The newest bends that have ended, each with the number of its counted quarters.
        self._ended: deque[tuple[Turn, int]] = deque(maxlen=_KEPT)
        self.forget()

    def forget(self) -> None:
        self._start_heading = 0.0
        self.turn: Turn | None = None
        self._ended.clear()
        self.late: list[Turn] = []
        self._new: list[tuple[int, int]] = []
        # Number of counted quarters of the turn in progress.
        self._counted = 0

    def take_counted(self) -> list[tuple[int, int]]:
        """Return start frame and side of each newly counted quarter."""
        if self.turn is not None:
            self._counted = self._count(self.turn, self._counted)
        new, self._new = self._new, []
        return new

    def take_late(self) -> list[Turn]:
        late, self.late = self.late, []
        return late

    def scale(self, factor: float) -> None:
        self._start_heading *= factor
        for _ in range(len(self._ended)):
            before, counted = self._ended.popleft()
            after = _scaled(before, factor)
            if abs(before.angle_deg) < self._min_angle <= abs(after.angle_deg):
                self.late.append(after)
            self._ended.append((after, self._count(after, counted)))
        if self.turn is not None:
            self.turn = _scaled(self.turn, factor)
            # The turn may end with the next frame.
            self._counted = self._count(self.turn, self._counted)

    def cut(self) -> Turn | None:
        """End the bend in progress; return it."""
        ended, self.turn = self.turn, None
        if ended is not None:
            self._ended.append((ended, self._counted))
        return ended

    def _count(self, turn: Turn, counted: int) -> int:
        """Count the new quarters of a turn; return the number of all its counted quarters."""
        if abs(turn.angle_deg) < self._min_angle:
            return counted
        further = turn.quarter_turns - counted
        if further * self._sign <= 0:
            return counted
        self._new += [(turn.start_frame, self._sign)] * abs(further)
        return turn.quarter_turns

    def update(
        self, frame: int, before: tuple[int, float], after: tuple[int, float],
    ) -> Turn | None:
        """Add a pair of frames, (stamp, degrees) each; return the bend that it ends."""
        rate = (after[1] - before[1]) / (after[0] - before[0]) * 1e9
        ended = None
        if self.turn is not None and before[0] - self.turn.end_ns > LONGEST_DIP_NS:
            ended = self.cut()
        if rate * self._sign <= self._min_rate:
            return ended
        if self.turn is None:
            self._start_heading = before[1]
            self._counted = 0
            self.turn = Turn(frame - 1, frame, before[0], after[0], after[1] - before[1], rate)
        else:
            peak = max(self.turn.peak_rate_deg_s, rate, key=abs)
            self.turn = Turn(
                self.turn.start_frame, frame, self.turn.start_ns, after[0],
                after[1] - self._start_heading, peak)
        return ended


def _scaled(turn: Turn, factor: float) -> Turn:
    return replace(
        turn, angle_deg=turn.angle_deg * factor,
        peak_rate_deg_s=turn.peak_rate_deg_s * factor)
