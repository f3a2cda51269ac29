# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Integrates the yaw of each pair of frames to the heading, and bridges missing pairs.

Angles are in radians, positive to the left (REP 103). The heading is 0 at the first frame and is
not wrapped: after a full circle to the left, it is 2 pi.
"""

from dataclasses import dataclass, replace
import math

from phase_traj_ros.core.heading.tuning import TUNING


@dataclass(frozen=True, slots=True)
class HeadingStep:
    """
    Change of the heading over one pair of frames.

    yaw
        Change of the heading, in radians, positive to the left.
    rate
        Yaw rate in radians per second.
    heading
        Heading after this pair, in radians relative to the first frame, not wrapped.
    bridged
        Whether the yaw was not measured, or rejected.
    variance
        Variance of the yaw in square radians, without corrections of earlier pairs.
    share
        Share of the pair in the time over which its yaw was measured.
    missed
        Standard deviation in radians of the correction of earlier pairs, which were bridged.
    foreseen
        Standard deviation in radians of a heading that is foreseen; 0 if it is measured.
    scale
        Relative standard deviation of all yaws since the start, from that of the focal length.
    """

    yaw: float
    rate: float
    heading: float
    bridged: bool
    variance: float = 0.0
    share: float = 1.0
    missed: float = 0.0
    foreseen: float = 0.0
    scale: float = 0.0

    def part(self, yaw: float, share: float) -> 'HeadingStep':
        """Return a part of the step with this yaw, and a share of its variance."""
        return replace(self, yaw=yaw, variance=share * self.variance)


class HeadingTracker:
    """
    Integrates yaw, and bridges missing or implausible yaws by the yaw rate of their neighbours.

    A missing pair is first given the previous rate, which fades. At the next measurement, the
    heading is corrected as if each of the two rates had lasted for half of the gap, but for not
    more than the time in which a rate fades. A jump of the rate that is impossible for a vehicle,
    as far as it is known, is bridged like a missing pair. If the next pair confirms it, the
    heading is corrected.
    """

    def __init__(self, scale_deviation: float = 0.0) -> None:
        """Make a tracker at heading 0, without a rate."""
        self.scale_deviation = scale_deviation
        """Relative standard deviation of all yaws, from that of the focal length."""
        self.heading = 0.0
        """Heading in radians since the first frame, positive to the left, not wrapped."""
        self.pairs = self.bridged = 0
        """Number of pairs; number of bridged ones."""
        self._rate: float | None = None
        self._rejected: _RejectedRate | None = None
        self._gap = self._bridged_yaw = self._interval = 0.0
        self._variance = self._variance_rate = 0.0
        self._agility = _Agility()

    def cut(self) -> None:
        """Keep the heading, and forget the rate: the next pair shows another scene."""
        self._rate = self._rejected = None
        self._gap = self._bridged_yaw = 0.0
        self._agility.cut()

    def scale(self, factor: float) -> None:
        """Multiply all angles so far by a factor, to correct them."""
        self.heading *= factor
        self._bridged_yaw *= factor
        self._variance *= factor * factor
        self._variance_rate *= factor * factor
        self._agility.scale(factor)
        self._rate = None if self._rate is None else self._rate * factor
        self._rejected = None

    @property
    def deviation(self) -> float:
        """Return the standard deviation of the heading in radians, without that of the lens."""
        return math.sqrt(self._variance)

    @property
    def rate(self) -> float:
        """Return the last accepted yaw rate in radians per second."""
        return 0.0 if self._rate is None else self._rate

    @property
    def bridged_share(self) -> float:
        """Return the share of bridged pairs, 0 before the first pair."""
        return self.bridged / self.pairs if self.pairs else 0.0

    def update(
        self, yaw: float | None, interval: float, *, certain: bool = False,
        variance: float = 0.0, share: float = 1.0,
    ) -> HeadingStep:
        """
        Add the next pair of frames, ``interval`` seconds apart, more than 0.

        ``yaw`` is in radians, positive to the left, None if it was not measured; ``variance`` in
        square radians; ``share`` that of the pair in the time over which it was measured. A
        ``certain`` yaw is accepted even if the rate jumps, as it does if a frame was lost and the
        stamps do not show it.
        """
        before, missed = self.heading, 0.0
        self.pairs += 1
        bridged = yaw is None or not self.admits(yaw, interval, certain=certain)
        if yaw is None or bridged:
            self._bridge(yaw, interval)
            share, variance = 1.0, self._bridged_variance(self._gap) - self._bridged_variance(
                self._gap - interval)
        else:
            rate = yaw / interval
            missed = self._correct(rate, interval, certain)
            self.heading += yaw
            self._rate, self._rejected = rate, None
            self._gap = self._bridged_yaw = 0.0
        self._interval = interval
        self._agility.add(yaw if certain else None, interval)
        self._variance_rate = variance / interval
        self._variance += variance + missed ** 2
        return HeadingStep(
            self.heading - before, self.rate, self.heading, bridged, variance, share, missed,
            scale=self.scale_deviation)

    def foresee(self, seconds: float, deviation: float) -> HeadingStep:
        """
        Return the step to a frame that is not measured, if the newest rate continues.

        It comes ``seconds`` after the newest pair, whose state does not change. ``deviation`` is
        the standard deviation of what is foreseen, in radians.
        """
        # Not -0.0 for a picture that is repeated in a turn to the right.
        yaw = self.rate * seconds or 0.0
        return HeadingStep(
            yaw, self.rate, self.heading + yaw, False, self._variance_rate * seconds,
            foreseen=deviation, scale=self.scale_deviation)

    def admits(self, yaw: float, interval: float, *, certain: bool = False) -> bool:
        """Return whether ``update`` would accept a yaw as possible for a vehicle."""
        rate = yaw / interval
        return self._follows_rate(rate, interval, certain) or (
            self._rejected is not None
            and self._is_possible(self._rejected.rate, rate, interval))

    def _follows_rate(self, rate: float, interval: float, certain: bool) -> bool:
        return certain or self._rate is None or self._is_possible(self._rate, rate, interval)

    def _is_possible(self, before: float, after: float, interval: float) -> bool:
        """Return whether this vehicle can change its yaw rate from that of the previous pair."""
        time = (self._interval + interval) / 2
        possible = TUNING.max_acceleration * time + TUNING.rate_error
        usual = math.sqrt(self._agility.process_noise * time)
        return abs(after - before) <= max(possible, TUNING.gate_deviations * usual)

    def _bridged_variance(self, gap: float) -> float:
        """Return the variance of the yaw after so many seconds without a measurement."""
        return (TUNING.bridged_deviation * gap) ** 2 + self._walked(gap)

    def _walked(self, gap: float) -> float:
        """Return the variance of the integral of a rate that walks at random until it fades."""
        return self._agility.process_noise * min(gap, TUNING.rate_fading_s) ** 3 / 3

    def _correct(self, rate: float, interval: float, certain: bool) -> float:
        """Correct the bridged pairs before an admitted rate; return the standard deviation."""
        gap, bridged_yaw, rejected = self._gap, self._bridged_yaw, self._rejected
        if rejected is not None and not self._follows_rate(rate, interval, certain):
            self.heading += rejected.rate * self._interval - rejected.filled
            gap, bridged_yaw = gap - self._interval, bridged_yaw - rejected.filled
            rate = rejected.rate
        lasted = min(gap, 2.0 * TUNING.rate_fading_s)
        mean = (self.rate + rate) / 2
        self.heading += mean * lasted - bridged_yaw
        # The change from one rate to the other may have been at any time within the gap. If both
        # ends of a random walk are known, its integral has a quarter of the variance.
        return math.hypot(
            (rate - self.rate) * gap / math.sqrt(12.0), mean * (gap - lasted),
            math.sqrt(self._walked(gap) / 4.0))

    def _bridge(self, yaw: float | None, interval: float) -> None:
        self.bridged += 1
        # Integral of the fading rate over this part of the gap.
        fading = TUNING.rate_fading_s
        filled = self.rate * fading * (
            math.exp(-self._gap / fading) - math.exp(-(self._gap + interval) / fading))
        self._gap += interval
        self._bridged_yaw += filled
        self.heading += filled
        self._rejected = None if yaw is None else _RejectedRate(yaw / interval, filled)


@dataclass(frozen=True, slots=True)
class _RejectedRate:
    """A rejected rate, and the change of the heading that was used instead."""

    rate: float
    filled: float


class _Agility:
    """
    Learns from a drive how fast the yaw rate of the vehicle changes.

    A model car changes its yaw rate faster than a car can. The yaw rate is modelled as a random
    walk. Its process noise is estimated from the changes of the rate between certain pairs.
    """

    def __init__(self) -> None:
        """Start with a vehicle that has not changed its rate."""
        self.process_noise = 0.0
        """Variance that the yaw rate gains per second, in (rad/s)^2/s."""
        self.cut()

    def cut(self) -> None:
        """Forget the last rate and keep the process noise: the next pair shows another scene."""
        self._rate: float | None = None
        # Time since that rate; yaw and time of the certain pairs in a row.
        self._since = self._turned = self._duration = 0.0

    def scale(self, factor: float) -> None:
        """Multiply all angles so far by a factor, to correct them."""
        self.process_noise *= factor * factor
        self._turned *= factor
        self._rate = None if self._rate is None else self._rate * factor

    def add(self, yaw: float | None, interval: float) -> None:
        """
        Add the yaw of the next pair of frames in radians, and its time in seconds, above 0.

        The yaw is None if it is missing or uncertain: learning from uncertain pairs would admit
        more of them.
        """
        self._since += interval
        if yaw is None:
            self._turned = self._duration = 0.0
            return
        self._turned += yaw
        self._duration += interval
        # The rate of a short pair errs by the jitter of its stamps.
        if self._duration < TUNING.min_rate_time_s:
            return
        rate, before = self._turned / self._duration, self._rate
        if before is not None:
            change = min(TUNING.max_rate_change, abs(rate - before))
            kept = math.exp(-self._since / TUNING.process_s)
            # Means of a random walk over the time that each of the two rates lasted.
            self.process_noise = kept * self.process_noise + (1.0 - kept) * change ** 2 / (
                self._since - self._duration / 3.0)
        self._rate = rate
        self._since = self._turned = self._duration = 0.0
