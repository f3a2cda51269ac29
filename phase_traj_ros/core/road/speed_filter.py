# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Predicts the speed of the vehicle, and bridges pairs whose distance is not measured."""

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
        self.deviation = TUNING.unknown_speed_deviation
        """Its standard deviation."""
        self.known = False
        """Whether a speed has been measured since."""
        self._unconfirmed: float | None = None
        # Whether a clear measurement has shown the speed, and the time since the first one.
        self._clear, self._age = False, 0.0
        # Relative standard deviation of the newest interval.
        self._interval_error = 0.0

    def predict(self, interval: float, *, interval_deviation: float = 0.0) -> None:
        """
        Predict ``interval`` seconds ahead, with an unknown but bounded acceleration.

        ``interval_deviation`` is the standard deviation of the interval.
        """
        if self.known:
            self._age += interval
        if self._unconfirmed is not None:
            self._unconfirmed += interval
            if self._unconfirmed > TUNING.confirmation_time + interval:
                self.forget()
        # The acceleration is not random: it may continue for a whole gap.
        self.deviation = min(
            self.deviation + TUNING.acceleration * interval, TUNING.unknown_speed_deviation)
        # Not an error of the speed: the error of the next interval may have the other sign.
        self._interval_error = interval_deviation / interval

    @property
    def observed_deviation(self) -> float:
        """Return the standard deviation of the speed of the newest pair by its stamps."""
        return math.hypot(self.deviation, self._interval_error * self.speed)

    @property
    def least(self) -> float:
        """Return the least speed that the vehicle may have, 0 or more, in either direction."""
        return max(abs(self.speed) - TUNING.gate * self.deviation, 0.0)

    @property
    def standing(self) -> bool:
        """Return whether the vehicle stood when its speed was last measured."""
        return self.known and self.speed == 0.0

    @property
    def may_stand(self) -> bool:
        """Return whether a known speed does not differ from 0 by more than its error."""
        return self.known and not self.doubtful and self.least == 0.0

    @property
    def lost(self) -> bool:
        """Return whether the speed was never measured, or too long ago."""
        return not self.known or self.deviation >= TUNING.unknown_speed_deviation

    @property
    def doubtful(self) -> bool:
        """Return whether the speed was not measured for about half a second."""
        return self.deviation >= TUNING.doubtful_deviation

    def bounds(self, deviation: float, *, reverses: bool = False) -> tuple[float, float]:
        """
        Return the search limits of a speed that is measured with this standard deviation.

        ``reverses`` is whether the blocks show that the vehicle moves backwards.
        """
        least = -TUNING.max_speed if reverses else -TUNING.max_unseen_reverse_speed
        # A pair whose interval is too short seems to be faster.
        most = TUNING.max_speed * (1.0 + self._interval_error)
        if self.lost:
            return least, 0.0 if reverses else most
        gate = TUNING.gate * math.hypot(self.observed_deviation, deviation)
        return max(self.speed - gate, least), min(self.speed + gate, most)

    def refuted_by(self, speed: float, time: float) -> float:
        """
        Return for how long, in seconds, the speed has been wrong if this is the true one.

        ``speed`` is that of a profile, a mean with this ``time`` constant, in seconds. 0 if the
        vehicle can have changed its speed, or if a clear measurement has shown the speed so far.
        """
        apart, lag = abs(speed - self.speed), TUNING.acceleration * time
        peak = TUNING.profile_width * abs(speed)
        possible = apart <= TUNING.gate * (self.deviation + lag) + peak
        return 0.0 if self._clear or self.lost or possible else self._age

    def add(self, speed: float, variance: float, *, clear: bool = False) -> None:
        """Add a measured speed; ``clear`` is whether it cannot be that of noise."""
        self._clear |= clear
        apart = abs(speed - self.speed)
        deviation = math.sqrt(variance)
        if self._unconfirmed is not None and apart > TUNING.gate * math.hypot(
                self.deviation, deviation):
            # The interval of the first speed was wrong, or that of this one.
            self._begin(speed, max(apart, self.deviation))
        elif not self.known:
            self._begin(speed, math.hypot(deviation, self._interval_error * speed))
        else:
            self._unconfirmed = None
            variance += (self._interval_error * self.speed) ** 2
            gain = self.deviation ** 2 / (self.deviation ** 2 + variance)
            self.speed += gain * (speed - self.speed)
            self.deviation *= math.sqrt(1.0 - gain)

    def _begin(self, speed: float, deviation: float) -> None:
        """Set a speed that the next one has to confirm."""
        # With a short interval, the noise of a peak may be a speed beyond all bounds.
        self.speed = min(max(speed, -TUNING.max_speed), TUNING.max_speed)
        self.deviation, self.known, self._unconfirmed = deviation, True, 0.0

    def stand(self, interval: float) -> Travel:
        """Set the speed to 0; return the distance of a standing pair."""
        self.speed, self.deviation, self.known = 0.0, 0.0, True
        self._unconfirmed, self._clear = None, True
        # A slower slide than this is not visible during the life of a keyframe.
        deviation = TUNING.peak_cells * CELL * interval / TUNING.creep_time
        return Travel(0.0, deviation ** 2, TravelState.STANDING)

    def bridge(self, interval: float, measured: Travel, *, turns: bool = False) -> Travel:
        """
        Return the distance of a pair at the last speed.

        ``measured`` is the newest measured distance, ``turns`` whether the vehicle turns in the
        pair, so that it may have started.
        """
        deviation = self.observed_deviation * interval
        # A vehicle that stood when it was last measured, and turns, mostly drives.
        if not self.known or (turns and self.speed == 0.0):
            return Travel(1.0, deviation ** 2, TravelState.UNKNOWN)
        distance = self.speed * min(interval, TUNING.max_bridged_time)
        if self.lost:
            # The drawn path continues with the last speed, but this is not a distance.
            return Travel(distance, deviation ** 2, TravelState.UNKNOWN)
        # The error of the speed is correlated between pairs, and includes those of the pitch.
        swing, tilt = measured.swing, measured.tilt
        variance = deviation ** 2 + (swing ** 2 + tilt ** 2) * distance ** 2
        if abs(distance) > CELL:
            swing = math.hypot(swing, deviation / distance)
        return Travel(distance, variance, TravelState.BRIDGED, swing, tilt)
