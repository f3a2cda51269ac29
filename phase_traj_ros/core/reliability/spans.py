# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The spans of a drive to which a reason applies."""

from collections.abc import Iterable, Mapping

from phase_traj_ros.core.reliability.reason import Reason
from phase_traj_ros.core.reliability.tuning import TUNING
from phase_traj_ros.core.reliability.verdict import joined, UnreliableSpan


class Spans:
    """The spans of one reason, which do not overlap, in order."""

    def __init__(self) -> None:
        """Start without spans."""
        self._kept: list[tuple[int, int]] = []

    def add(self, start_ns: int, end_ns: int) -> None:
        """Add a span that ends after all others; close ones are joined."""
        if end_ns <= start_ns:
            return
        kept = self._kept
        if kept and start_ns - kept[-1][1] <= TUNING.part_ns:
            kept[-1] = kept[-1][0], end_ns
            return
        kept.append((start_ns, end_ns))
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
            taken += min(end, end_ns) - max(start, start_ns)
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
