# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Predicts the speed of the vehicle from earlier speeds, and what it drives if nothing is seen."""

import math

from phase_traj_ros.core.road.ground import CELL
from phase_traj_ros.core.road.travel import Travel, TravelState
from phase_traj_ros.core.road.tuning import TUNING


class SpeedFilter:
    """Filters the speed, in camera heights per second."""

    def __init__(self) -> None:
        """Start with an unknown speed."""
        self.forget()

    def forget(self) -> None:
        """Forget the speed."""
        self.speed = 0.0
        """Speed in camera heights per second."""
        self.deviation = TUNING.any_speed
        """Its standard deviation."""
        self.known = False
        """Whether a speed has been measured since."""
        self._unconfirmed: float | None = None
        # Relative standard deviation of the newest interval.
        self._off = 0.0

    def pass_time(self, interval: float, *, unsure: float = 0.0) -> None:
        """
        Predict ``interval`` seconds ahead, with an unknown but bounded acceleration.

        ``unsure`` is the standard deviation of the interval.
        """
        if self._unconfirmed is not None:
            self._unconfirmed += interval
            if self._unconfirmed > TUNING.confirmed + interval:
                self.forget()
        # The acceleration is not random: it may continue for a whole gap.
        self.deviation = min(
            self.deviation + TUNING.acceleration * interval, TUNING.any_speed)
        # Not an error of the speed: the next interval may be off to the other side.
        self._off = unsure / interval

    @property
    def seen_deviation(self) -> float:
        """Return the standard deviation of the speed at which the newest pair is seen to move."""
        return math.hypot(self.deviation, self._off * self.speed)

    @property
    def lost(self) -> bool:
        """Return whether the speed is unknown: never measured, or too long ago."""
        return not self.known or self.deviation >= TUNING.any_speed

    def bounds(self, deviation: float) -> tuple[float, float]:
        """Return the limits between which a speed is measured, with this standard deviation."""
        if self.lost:
            return -TUNING.backwards, TUNING.fastest
        off = TUNING.gate * math.hypot(self.seen_deviation, deviation)
        return max(self.speed - off, -TUNING.backwards), min(self.speed + off, TUNING.fastest)

    def add(self, speed: float, variance: float) -> None:
        """Add a measured speed."""
        if not self.known:
            # Of two frames a moment apart, the noise of a peak is a speed beyond all bounds.
            self.speed = min(max(speed, -TUNING.backwards), TUNING.fastest)
            self.deviation = math.hypot(math.sqrt(variance), self._off * self.speed)
            self.known = True
            self._unconfirmed = 0.0
            return
        self._unconfirmed = None
        variance += (self._off * self.speed) ** 2
        gain = self.deviation ** 2 / (self.deviation ** 2 + variance)
        self.speed += gain * (speed - self.speed)
        self.deviation *= math.sqrt(1.0 - gain)

    def stand(self, interval: float) -> Travel:
        """Set the speed to 0, as the vehicle stands; return the distance of the pair."""
        self.speed, self.deviation, self.known = 0.0, 0.0, True
        self._unconfirmed = None
        # A slower slide than this would not be seen while a keyframe is kept.
        return Travel(
            0.0, (TUNING.peak_cells * CELL * interval / TUNING.creeps) ** 2, TravelState.STANDING)

    def bridge(self, interval: float, measured: Travel, *, turns: bool = False) -> Travel:
        """
        Return the distance of a pair at the last speed.

        ``measured`` is the newest measured distance, ``turns`` whether the vehicle turns in the
        pair, as only one that drives can.
        """
        off = self.seen_deviation * interval
        # A turning vehicle moves, even if it was standing when it was last measured.
        if not self.known or (turns and self.speed == 0.0):
            return Travel(1.0, off ** 2, TravelState.UNKNOWN)
        way = self.speed * min(interval, TUNING.holds)
        if self.lost:
            # The drawn path continues with the last speed, but this is not a distance.
            return Travel(way, off ** 2, TravelState.UNKNOWN)
        # The error of the speed is correlated between pairs, and it has those of the pitch.
        swing, tilt = measured.swing, measured.tilt
        variance = off ** 2 + (swing ** 2 + tilt ** 2) * way ** 2
        if abs(way) > CELL:
            swing = math.hypot(swing, off / way)
        return Travel(way, variance, TravelState.BRIDGED, swing, tilt)
