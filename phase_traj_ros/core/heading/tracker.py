# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Heading from the yaw of each pair of frames: what is measured is added up, the rest is bridged.

Angles in radians, left positive, as REP 103 has it; the heading is 0 at the first frame and is
not wrapped: after a full circle to the left it is 2 pi.
"""

from dataclasses import dataclass
import math

# A change of the yaw rate faster than this is not believed of a vehicle until it lasts: radians
# per second squared, on top of what measuring errors make of the rate.
_MOST_ACCELERATION = math.radians(300.0)
_RATE_ERROR = math.radians(5.0)
# How long a yaw rate is taken to go on when nothing is measured, seconds (time constant).
_PERSISTENCE = 1.0
# What a bridged yaw rate may be off by (standard deviation), radians per second.
_BRIDGED_RATE = math.radians(5.0)


@dataclass(frozen=True, slots=True)
class HeadingStep:
    """
    What one pair of frames adds to the heading.

    yaw
        By how much the heading has changed, in radians, left positive.
    rate
        Yaw rate in radians per second.
    heading
        After this pair, in radians since the first frame, not wrapped.
    bridged
        Whether the yaw was not measured, or not believed.
    variance
        Of the yaw, in square radians.
    """

    yaw: float
    rate: float
    heading: float
    bridged: bool
    variance: float = 0.0


class HeadingTracker:
    """
    Adds up yaw, and bridges what is missing or cannot be by the yaw rate of its neighbours.

    A missing pair first gets the rate before it, which fades; once there is a measurement again,
    the heading is corrected as if the rate had changed evenly in between. A jump of the rate that
    no vehicle makes is bridged as if it were missing, unless the next pair confirms it: then it
    is made up for.
    """

    def __init__(self) -> None:
        """Make a tracker at heading 0."""
        self.reset()

    def reset(self) -> None:
        """Start anew: heading 0, no rate, nothing counted."""
        self._heading = 0.0
        self._rate: float | None = None
        self._pairs = 0
        self._bridged = 0
        self._gap = 0.0
        self._filled = 0.0
        self._doubted: _Doubted | None = None
        self._interval = 0.0

    def cut(self) -> None:
        """Keep the heading, and forget the rate: the next pair is of another scene."""
        self._rate = self._doubted = None
        self._gap = self._filled = 0.0

    def scale(self, factor: float) -> None:
        """Correct all angles so far, which turn out to be wrong by a factor."""
        self._heading *= factor
        self._filled *= factor
        self._rate = None if self._rate is None else self._rate * factor
        self._doubted = None

    @property
    def heading(self) -> float:
        """Return the heading in radians since the first frame, left positive, not wrapped."""
        return self._heading

    @property
    def rate(self) -> float:
        """Return the yaw rate in radians per second, the last that was believed."""
        return 0.0 if self._rate is None else self._rate

    @property
    def pairs(self) -> int:
        """Return how many pairs there were."""
        return self._pairs

    @property
    def bridged(self) -> int:
        """Return how many of them were bridged."""
        return self._bridged

    @property
    def bridged_share(self) -> float:
        """Return the share of pairs that were bridged, 0 before the first."""
        return self._bridged / self._pairs if self._pairs else 0.0

    def update(
        self, yaw: float | None, interval: float, *, certain: bool = False,
        variance: float = 0.0,
    ) -> HeadingStep:
        """
        Take the next pair of frames.

        Parameters
        ----------
        yaw
            In radians, left positive; None if it was not measured.
        interval
            Between the two frames, in seconds.
        certain
            Whether the yaw is beyond doubt, however it jumps: so it does where a frame was lost
            and the stamps do not tell.
        variance
            Of the yaw, in square radians.

        Raises
        ------
        ValueError
            The interval is not a finite number above 0, or the yaw is not finite; nothing has
            changed.

        """
        if not (math.isfinite(interval) and interval > 0):
            raise ValueError(f'interval is {interval}: give a finite number of seconds above 0')
        if yaw is not None and not math.isfinite(yaw):
            raise ValueError(f'yaw is {yaw}: give a finite number, or None')
        before = self._heading
        self._pairs += 1
        bridged = yaw is None or not self._believe(yaw / interval, interval, certain)
        if yaw is None or bridged:
            self._bridge(yaw, interval)
        else:
            self._heading += yaw
            self._rate = yaw / interval
            self._gap = self._filled = 0.0
            self._doubted = None
        self._interval = interval
        return HeadingStep(
            self._heading - before, self.rate, self._heading, bridged,
            (_BRIDGED_RATE * interval) ** 2 if bridged else variance)

    def _believe(self, rate: float, interval: float, certain: bool) -> bool:
        """Return whether a measured rate holds; if so, correct what was filled in before it."""
        doubted = self._doubted
        if (certain or self._rate is None
                or _can_be(self._rate, rate, (self._interval + interval) / 2)):
            if self._gap <= _PERSISTENCE:
                self._heading += (self.rate + rate) / 2 * self._gap - self._filled
            return True
        if doubted is not None and _can_be(
                doubted.rate, rate, (self._interval + interval) / 2):
            self._heading += doubted.rate * self._interval - doubted.filled
            return True
        # Over a long gap, anything may have happened.
        return self._gap > _PERSISTENCE

    def _bridge(self, yaw: float | None, interval: float) -> None:
        self._bridged += 1
        # What the rate before makes of this part of the gap, as it fades.
        filled = self.rate * _PERSISTENCE * (
            math.exp(-self._gap / _PERSISTENCE) - math.exp(-(self._gap + interval) / _PERSISTENCE))
        self._gap += interval
        self._filled += filled
        self._heading += filled
        self._doubted = None if yaw is None else _Doubted(yaw / interval, filled)


@dataclass(frozen=True, slots=True)
class _Doubted:
    """A measured rate that was not believed, and by how much the heading changed instead."""

    rate: float
    filled: float


def _can_be(before: float, after: float, interval: float) -> bool:
    return abs(after - before) <= _MOST_ACCELERATION * interval + _RATE_ERROR
