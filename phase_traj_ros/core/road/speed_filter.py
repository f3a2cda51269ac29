# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Predicts the speed of the vehicle from earlier speeds."""

import math

# Acceleration of a vehicle in camera heights per second squared (3.3 m/s2 at 1.65 m).
_ACCELERATION = 2.0
# Search range of the speed, in standard deviations: of the acceleration, that is what tyres hold.
_GATE = 3.0
# Largest speeds forward and in reverse, in camera heights per second.
_FASTEST, _BACKWARDS = 45.0, 3.0
# Standard deviation of an unknown speed.
_ANY = 10.0
# A first speed that no second one confirms within so many seconds was none.
_CONFIRMED = 0.5


class SpeedFilter:
    """Filters the speed, in camera heights per second."""

    def __init__(self) -> None:
        """Start with an unknown speed."""
        self.forget()

    def forget(self) -> None:
        """Forget the speed."""
        self.speed = 0.0
        """Speed in camera heights per second."""
        self.deviation = _ANY
        """Its standard deviation."""
        self.known = False
        """Whether a speed has been measured since."""
        self._unconfirmed: float | None = None

    def pass_time(self, interval: float, *, unsure: float = 0.0) -> None:
        """
        Predict ``interval`` seconds ahead, with an unknown but bounded acceleration.

        ``unsure`` is the standard deviation of the interval.
        """
        if self._unconfirmed is not None:
            self._unconfirmed += interval
            if self._unconfirmed > _CONFIRMED + interval:
                self.forget()
        # The acceleration is not random: it may continue for a whole gap.
        grown = self.deviation + _ACCELERATION * interval
        self.deviation = min(math.hypot(grown, self.speed * unsure / interval), _ANY)

    @property
    def lost(self) -> bool:
        """Return whether the speed is unknown: never measured, or too long ago."""
        return not self.known or self.deviation >= _ANY

    def bounds(self, deviation: float) -> tuple[float, float]:
        """Return the limits between which a speed is measured, with this standard deviation."""
        if self.lost:
            return -_BACKWARDS, _FASTEST
        off = _GATE * math.hypot(self.deviation, deviation)
        return max(self.speed - off, -_BACKWARDS), min(self.speed + off, _FASTEST)

    def add(self, speed: float, variance: float) -> None:
        """Add a measured speed."""
        if not self.known:
            # Of two frames a moment apart, the noise of a peak is a speed beyond all bounds.
            self.speed = min(max(speed, -_BACKWARDS), _FASTEST)
            self.deviation, self.known = math.sqrt(variance), True
            self._unconfirmed = 0.0
            return
        self._unconfirmed = None
        gain = self.deviation ** 2 / (self.deviation ** 2 + variance)
        self.speed += gain * (speed - self.speed)
        self.deviation *= math.sqrt(1.0 - gain)

    def stand(self) -> None:
        """Set the speed to 0: the vehicle stands."""
        self.speed, self.deviation, self.known = 0.0, 0.0, True
        self._unconfirmed = None
