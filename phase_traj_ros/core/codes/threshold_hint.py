# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Checks whether the paper's threshold fits a camera, from the measured shifts.

With a threshold that is too high no turn is found; with one that is too low, nothing but turns.
"""

from collections import deque
from dataclasses import dataclass
from enum import Enum
from statistics import median

from phase_traj_ros.core.codes.tuning import TUNING


class Misfit(Enum):
    """How the threshold does not fit."""

    TOO_HIGH = 'too_high'
    TOO_LOW = 'too_low'
    FLICKERING = 'flickering'
    """Turns end as soon as they begin."""


@dataclass(frozen=True, slots=True)
class ThresholdHint:
    """
    What to do about a threshold that does not fit.

    misfit
        How it does not fit.
    sentence
        The hint as a sentence for users.
    suggested_px
        A threshold that may fit, in pixels per frame; None if the shifts do not suggest one.
    """

    misfit: Misfit
    sentence: str
    suggested_px: float | None


class ShiftSummary:
    """Compares the shifts of a drive with the threshold, in a few numbers."""

    def __init__(self) -> None:
        """Make an empty summary."""
        # Shifts per pair and per second.
        self._newest: deque[tuple[float, float]] = deque(maxlen=TUNING.lasting_pairs)
        self._pairs = self._beyond = self._turns = self._short = self._length = 0
        self._threshold = self._largest = self._fastest = 0.0

    def add(self, dx: float, threshold: float, *, interval: float) -> None:
        """
        Take the next measured pair: two frames that are ``interval`` seconds apart.

        Its shift ``dx`` and the threshold are in pixels of the full frame.
        """
        self._pairs += 1
        self._threshold = threshold
        self._newest.append((dx, dx / interval))
        if len(self._newest) == TUNING.lasting_pairs:
            lasting, fast = (abs(median(each)) for each in zip(*self._newest))
            self._largest = max(self._largest, lasting)
            self._fastest = max(self._fastest, fast)
        if abs(dx) >= threshold:
            self._beyond += 1
            self._length += 1
        else:
            self._end_turn()

    def miss(self) -> None:
        """Record a pair that was not measured: it interrupts a lasting shift."""
        self._newest.clear()
        self._end_turn()

    def _end_turn(self) -> None:
        if self._length:
            self._turns += 1
            self._short += self._length <= TUNING.short_turn_pairs
        self._length = 0

    def hint(self, width: int) -> ThresholdHint | None:
        """Return the hint for frames ``width`` pixels wide; None if the threshold may fit."""
        if self._pairs < TUNING.min_pairs:
            return None
        turned = self._fastest >= TUNING.min_turn_speed * width
        fitting = self._largest * TUNING.threshold_share if turned else None
        if turned and self._largest < self._threshold:
            return _hint(
                Misfit.TOO_HIGH, f'no lasting shift reached the threshold of {self._threshold:.3g}'
                f' px, the largest was {self._largest:.2g} px: if the vehicle turned,', fitting)
        if self._beyond >= TUNING.max_beyond * self._pairs:
            higher = fitting is not None and fitting > self._threshold
            return _hint(
                Misfit.TOO_LOW, f'{100 * self._beyond / self._pairs:.0f} % of the pairs shift by'
                f' the threshold of {self._threshold:.3g} px or more, too many for turns:',
                fitting if higher else None)
        if self._turns >= TUNING.min_flickers and self._short >= TUNING.max_short * self._turns:
            return _hint(
                Misfit.FLICKERING, f'with a threshold of {self._threshold:.3g} px, most turns end'
                ' as soon as they begin:', fitting)
        return None


def _hint(misfit: Misfit, finding: str, suggested: float | None) -> ThresholdHint:
    """Return the hint that begins with this finding, and ends with what to try."""
    instead = '' if suggested is None else f', or a threshold of about {suggested:.2g} px'
    return ThresholdHint(misfit, f'{finding} try code_source auto{instead}', suggested)
