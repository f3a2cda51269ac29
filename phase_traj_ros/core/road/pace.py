# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How fast the vehicle can be, given how fast it was."""

import math

# Change of speed of a vehicle, in heights of the camera per second squared (4 m/s2 at 1.65 m);
# hard braking is twice that.
_ACCELERATION = 2.5
# Standard deviations within which the speed is looked for.
_GATE = 4.0
# No vehicle is faster, in heights per second; a reverse gear goes this fast at most.
_FASTEST, _BACKWARDS = 45.0, 3.0
# Of the speed, once nothing is known of it any more.
_ANY = 12.0


class Pace:
    """A forward filter over the speed, in heights of the camera per second."""

    def __init__(self) -> None:
        """Make one that knows nothing."""
        self.forget()

    def forget(self) -> None:
        """Forget the speed."""
        self.speed = 0.0
        """Heights per second."""
        self.deviation = _ANY
        """Its standard deviation."""
        self.known = False
        """Whether a speed has ever been measured since."""

    def pass_time(self, interval: float) -> None:
        """Go on by so many seconds, with an acceleration that is not known but bounded."""
        # Bounded, and not random: it may well go on for the whole of a gap.
        self.deviation = min(self.deviation + _ACCELERATION * interval, _ANY)

    @property
    def lost(self) -> bool:
        """Return whether nothing is known of the speed: never measured, or too long ago."""
        return not self.known or self.deviation >= _ANY

    @property
    def bounds(self) -> tuple[float, float]:
        """Return between which speeds it is."""
        if self.lost:
            return -_BACKWARDS, _FASTEST
        return (
            max(self.speed - _GATE * self.deviation, -_BACKWARDS),
            min(self.speed + _GATE * self.deviation, _FASTEST))

    def add(self, speed: float, variance: float) -> None:
        """Take a measured speed."""
        if not self.known:
            # Of two frames a moment apart, the noise of a peak is a speed beyond all bounds.
            self.speed = min(max(speed, -_BACKWARDS), _FASTEST)
            self.deviation, self.known = math.sqrt(variance), True
            return
        gain = self.deviation ** 2 / (self.deviation ** 2 + variance)
        self.speed += gain * (speed - self.speed)
        self.deviation *= math.sqrt(1.0 - gain)

    def stand(self) -> None:
        """Take that the vehicle stands."""
        self.speed, self.deviation, self.known = 0.0, 0.0, True
