# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a drive is reliable, and the spans in which it is not."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from phase_traj_ros.core.reliability.reason import Reason
from phase_traj_ros.core.reliability.tuning import TUNING


@dataclass(frozen=True, slots=True)
class UnreliableSpan:
    """A part of a drive that is not reliable, from one stamp to another, in nanoseconds."""

    start_ns: int
    end_ns: int
    reasons: tuple[Reason, ...]


@dataclass(frozen=True, slots=True)
class Reliability:
    """
    Whether a result is reliable; ``reasons`` is empty if it is.

    A verdict of ``ReliabilityMonitor`` is on the last minute of a drive, ``of_drive`` on all of
    it. Spans with different reasons may overlap.
    """

    reasons: tuple[Reason, ...] = ()
    spans: tuple[UnreliableSpan, ...] = ()
    """The parts of the drive so far that are not reliable, in the order in which they start."""
    start_ns: int = 0
    """Stamp at which the drive starts."""
    end_ns: int = 0
    """Stamp of its newest frame."""
    still_ns: int = 0
    """For how much of it the vehicle stood."""

    @property
    def reliable(self) -> bool:
        """Return whether the result is reliable."""
        return not self.reasons

    @property
    def words(self) -> tuple[str, ...]:
        """Return the reasons as the words used in files and messages."""
        return tuple(reason.value for reason in self.reasons)

    @property
    def of_drive(self) -> 'Reliability':
        """
        Return the verdict on the whole drive, with the reasons of its spans, longest first.

        The drive is reliable if the spans are not more than 5 % of it, and those with a camera
        that is not known, which are parts in which the vehicle moves, not more than 5 % of the
        time in which it moves, or of a minute if that is longer.
        """
        lasts_ns = self.end_ns - self.start_ns
        if lasts_ns <= 0:
            return self
        moves_ns = max(lasts_ns - self.still_ns, min(lasts_ns, TUNING.window_ns))
        lasted: Counter[Reason] = Counter()
        if (self._doubted_ns(*Reason) > TUNING.max_unreliable * lasts_ns
                or self._doubted_ns(Reason.CAMERA_NOT_KNOWN) > TUNING.max_unreliable * moves_ns):
            for span in self.spans:
                for reason in span.reasons:
                    lasted[reason] += span.end_ns - span.start_ns
        return replace(self, reasons=tuple(reason for reason, _ in lasted.most_common()))

    def _doubted_ns(self, *reasons: Reason) -> int:
        """Return how long the spans with one of these reasons last together."""
        spans = [(span.start_ns, span.end_ns) for span in self.spans
                 if not set(reasons).isdisjoint(span.reasons)]
        return sum(end - start for start, end in joined(spans))


def joined(spans: Iterable[tuple[int, int]], *, within: int = 0) -> list[tuple[int, int]]:
    """Return spans in order, joined where they overlap, or ``within`` these nanoseconds."""
    joined: list[tuple[int, int]] = []
    for start, end in sorted(spans):
        if joined and start - joined[-1][1] <= within:
            joined[-1] = joined[-1][0], max(joined[-1][1], end)
        else:
            joined.append((start, end))
    return joined


class Spans:
    """The spans of one reason, which do not overlap, in order."""

    def __init__(self) -> None:
        """Start without spans."""
        self._kept: list[tuple[int, int]] = []

    def add(self, start_ns: int, end_ns: int) -> None:
        """Add a span; close ones are joined."""
        if end_ns <= start_ns:
            return
        kept = self._kept = joined([*self._kept, (start_ns, end_ns)], within=TUNING.part_ns)
        if len(kept) > TUNING.max_spans:
            first = min(range(len(kept) - 1), key=lambda n: kept[n + 1][0] - kept[n][1])
            kept[first:first + 2] = [(kept[first][0], kept[first + 1][1])]

    def of(self, lasts: bool, start_ns: int, end_ns: int) -> list[tuple[int, int]]:
        """Return the spans, and a last one if the reason ``lasts``."""
        return joined([*self._kept, (start_ns, end_ns)]) if lasts else list(self._kept)

    def within(self, start_ns: int, end_ns: int) -> int:
        """Return the overlap of the spans with another one, in nanoseconds."""
        taken = 0
        for start, end in reversed(self._kept):
            if end <= start_ns:
                break
            taken += max(min(end, end_ns) - max(start, start_ns), 0)
        return taken


def in_order(spans: Mapping[Reason, Iterable[tuple[int, int]]]) -> tuple[UnreliableSpan, ...]:
    """Return the spans of all reasons in order; equal ones are one span with several reasons."""
    found: dict[tuple[int, int], list[Reason]] = {}
    for reason, reason_spans in spans.items():
        for span in reason_spans:
            found.setdefault(span, []).append(reason)
    return tuple(
        UnreliableSpan(start, end, tuple(reasons))
        for (start, end), reasons in sorted(found.items(), key=lambda each: each[0]))
