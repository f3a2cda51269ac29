# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Selection of the frames of a source."""

from dataclasses import dataclass

from phase_traj_ros.errors import ParameterError

# 32 years: what is left of 64 bits of nanoseconds after it holds any stamp.
_MOST = 1e9


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """
    A part of a source, of which every N-th frame is used.

    Of the frames stamped within [start, start + duration), in seconds from the first frame's
    stamp (duration None: to the end), every N-th is used, beginning with the first of them. A
    start of 0 excludes no frame, not even one stamped before the first (a bag that was looped).

    Raises ParameterError if start is negative, duration is not positive, either of them is above
    1e9 s, or every is not a positive whole number.
    """

    start: float = 0.0
    duration: float | None = None
    every: int = 1

    def __post_init__(self) -> None:
        if not 0 <= self.start <= _MOST:
            raise ParameterError(
                f'start must be a number of seconds from 0 to {_MOST:g}, not {self.start}')
        if self.duration is not None and not 0 < self.duration <= _MOST:
            raise ParameterError(
                f'duration must be a number of seconds above 0, at most {_MOST:g}, not'
                f' {self.duration}')
        if not isinstance(self.every, int) or isinstance(self.every, bool) or self.every < 1:
            raise ParameterError(f'every must be a whole number >= 1, not {self.every}')

    @property
    def start_ns(self) -> int:
        """Start of the part in nanoseconds since the first frame."""
        return round(self.start * 1e9)

    @property
    def end_ns(self) -> int | None:
        """End of the part in nanoseconds since the first frame, None if it is open."""
        return None if self.duration is None else self.start_ns + round(self.duration * 1e9)


EVERYTHING = Selection()
"""All frames."""


class Selector:
    """
    Applies a Selection to the frames of one source, one after the other.

    A reader may stop early, which matters in long bags. It does not stop at the first frame after
    the end, whose stamp may be wrong, but after several of them in a row.
    """

    PATIENCE = 50

    def __init__(self, selection: Selection, first_ns: int | None = None) -> None:
        """Count times from ``first_ns``; by default, from the stamp of the first frame judged."""
        self._selection = selection
        self._first_ns = first_ns
        self._behind_in_a_row = 0
        self.over = False
        """Whether no later frame is selected."""
        self.inside = 0
        """Number of frames within the part so far, of which every N-th is selected."""
        self.span_ns = 0
        """Latest stamp so far, in nanoseconds since the first frame."""

    def judge(self, stamp_ns: int) -> bool:
        """Return whether the next frame, stamped in nanoseconds, is selected."""
        if self._first_ns is None:
            self._first_ns = stamp_ns
        elapsed = stamp_ns - self._first_ns
        self.span_ns = max(self.span_ns, elapsed)
        start, end = self._selection.start_ns, self._selection.end_ns
        if end is not None and elapsed >= end:
            self._behind_in_a_row += 1
            self.over = self.over or self._behind_in_a_row > self.PATIENCE
            return False
        self._behind_in_a_row = 0
        if self.over or (start and elapsed < start):
            return False
        self.inside += 1
        return (self.inside - 1) % self._selection.every == 0
