# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Detects the bends of the path to one side.

A bend is a part of the path in which the heading changes steadily to one side. It is found with a
cumulative sum (Page, "Continuous inspection schemes", 1954) of the change of the heading minus
that of the gentlest bend. A bend starts at the minimum of this sum and ends at its maximum. A
straight, or a bend to the other side, that is longer than a dip ends it, and so does a turn to the
other side, however short. A dip is shorter than the distance in which the bend itself turns by 10
degrees.
"""

from collections import deque
from dataclasses import dataclass, replace
import math

from phase_traj_ros.core.heading.tuning import TUNING


@dataclass(frozen=True, slots=True)
class PathPoint:
    """A frame: its heading in degrees, and the distance to it in camera heights."""

    frame: int
    stamp_ns: int
    heading: float
    distance: float

    def scaled(self, factor: float) -> 'PathPoint':
        """Return the point with its heading multiplied by a factor."""
        return replace(self, heading=factor * self.heading)


@dataclass(frozen=True, slots=True)
class Bend:
    """A bend from one point to another; angles are in degrees, positive to the left (REP 103)."""

    first: PathPoint
    end: PathPoint
    peak_rate: float
    """Yaw rate of the fastest pair of frames, in degrees per second."""

    @property
    def angle(self) -> float:
        """Return the change of the heading."""
        return self.end.heading - self.first.heading

    def scaled(self, factor: float) -> 'Bend':
        """Return the bend with all its angles multiplied by a factor."""
        return Bend(self.first.scaled(factor), self.end.scaled(factor), factor * self.peak_rate)


def quarter_turns(angle: float) -> int:
    """Return an angle in degrees in quarter turns, rounded, halves away from 0."""
    return int(math.copysign(math.floor(abs(angle) / 90 + 0.5), angle))


class BendDetector:
    """
    Detects the bends to one side, and counts the quarter turns of those that are turns.

    It stores only the two ends of a bend, so its memory does not grow with the length of the bend.
    """

    def __init__(self, sign: int, least_turn: float) -> None:
        """
        Make a detector that waits for its first pair of frames.

        ``sign`` is 1 for bends to the left, -1 to the right; a bend of ``least_turn`` degrees or
        more is a turn.
        """
        self._sign = sign
        self._least_turn = least_turn
        # The newest bends that have ended, each with its counted quarters and its largest angle.
        self._ended: deque[tuple[Bend, int, float]] = deque(maxlen=TUNING.kept_bends)
        self._quarters: list[tuple[int, int]] = []
        self._begin(None)

    def _begin(self, first: PathPoint | None) -> None:
        """Begin a bend at a point, or at the next frame."""
        # Start of the bend in progress, or of the next one, and its end so far.
        self._first = first
        self._end: PathPoint | None = None
        # Its largest yaw rate, the distance at which it turned last, and the lowest score since.
        self._peak, self._counted = 0.0, 0
        self._turned_at = 0.0 if first is None else first.distance
        self._lowest = math.inf if first is None else self._score(first)

    @property
    def bend(self) -> Bend | None:
        """Return the bend in progress."""
        if self._first is None or self._end is None:
            return None
        return Bend(self._first, self._end, self._sign * self._peak)

    def update(self, before: PathPoint, after: PathPoint, rate: float | None) -> Bend | None:
        """
        Add a pair of frames; return the bend that has ended before it.

        ``rate`` is its yaw rate in degrees per second, None if it is that of the two headings.
        """
        ended = self.cut() if self._has_ended(before) else None
        if self._first is None:
            self._begin(before)
        assert self._first is not None
        score = self._score(after)
        if score <= self._score(self._first):
            # Counted quarters are not revoked.
            ended = ended or self.cut()
            self._begin(after)
            return ended
        if rate is None:
            rate = (after.heading - before.heading) / (after.stamp_ns - before.stamp_ns) * 1e9
        self._peak = max(self._peak, self._sign * rate)
        self._lowest = min(self._lowest, score)
        if self._end is None or score > self._score(self._end):
            self._end = after
        if score > self._lowest + TUNING.dip_end_deg:
            self._lowest, self._turned_at = score, after.distance
        self._counted = self._count(self.bend, self._counted)
        return ended

    def cut(self) -> Bend | None:
        """End the bend in progress; return it."""
        bend = self.bend
        if bend is not None and abs(bend.angle) >= TUNING.swerve_deg:
            self._ended.append((bend, self._counted, abs(bend.angle)))
        self._begin(None)
        return bend

    def scale(self, factor: float) -> list[Bend]:
        """Multiply all headings so far by a factor; return the ended bends that become turns."""
        late = []
        for number, (before, counted, widest) in enumerate(self._ended):
            after = before.scaled(factor)
            if widest < self._least_turn <= abs(after.angle):
                late.append(after)
            self._ended[number] = (
                after, self._count(after, counted), max(widest, abs(after.angle)))
        self._first = None if self._first is None else self._first.scaled(factor)
        self._end = None if self._end is None else self._end.scaled(factor)
        self._peak *= factor
        # The bend may end with the next frame.
        self._counted = self._count(self.bend, self._counted)
        return late

    def take_quarters(self) -> list[tuple[int, int]]:
        """Return the start frame and the side of each quarter turn that has newly been counted."""
        new, self._quarters = self._quarters, []
        return new

    def _score(self, point: PathPoint) -> float:
        """Return the cumulative sum at a point."""
        return self._sign * point.heading - TUNING.min_bend_rate_deg * point.distance

    def _has_ended(self, point: PathPoint) -> bool:
        """Return whether the path from the end of the bend to a point ends it."""
        bend = self.bend
        if bend is None:
            return False
        # However small the least turn is, a wrong pair of frames does not end one.
        if self._sign * (bend.end.heading - point.heading) >= max(
                self._least_turn, TUNING.turn_deg):
            return True
        dip = TUNING.dip_deg * (bend.end.distance - bend.first.distance) / abs(bend.angle)
        dip = min(max(dip, TUNING.min_dip), TUNING.max_dip)
        return point.distance - self._turned_at > dip

    def _count(self, bend: Bend | None, counted: int) -> int:
        """Count the new quarters of a bend; return the number of all its counted quarters."""
        if bend is None or abs(bend.angle) < self._least_turn:
            return counted
        quarters = quarter_turns(bend.angle)
        further = self._sign * (quarters - counted)
        if further <= 0:
            return counted
        self._quarters += [(bend.first.frame, self._sign)] * further
        return quarters
