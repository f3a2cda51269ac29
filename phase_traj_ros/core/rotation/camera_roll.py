# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Estimates the current roll of the camera relative to the vertical, and to the road.

The roll is the sum of the roll of the mounting and of the lean of the vehicle: in a turn, a car
leans to the outside by a degree or two, a bicycle to the inside by up to 20 degrees, and a banked
road turns both to the inside. There are two measurements. First, the blocks show each change of
the roll. Second, a vehicle turns about the vertical axis, so a camera with a roll sees a part of
the turn as a pitch.
"""

import math

from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.swaying_angle import mounting_drift, SwayingAngle
from phase_traj_ros.core.rotation.camera_motion import CameraMotion, running_mean
from phase_traj_ros.core.rotation.focus_of_expansion import Mounting
from phase_traj_ros.core.rotation.tuning import TUNING


class CameraRoll(SwayingAngle):
    """Estimates the roll, positive right side down, with a Kalman filter of mounting and lean."""

    def __init__(self, horizon: Horizon, *, lean: float = 0.0) -> None:
        """Start with the roll of a ``horizon``, and with the lean of the vehicle in radians."""
        super().__init__(horizon.roll, deviation=horizon.roll_deviation,
                         sway=lean, sway_deviation=TUNING.lean_deviation)
        self.yaw_rate = 0.0
        """Mean yaw rate in radians per second, without the shaking of the camera."""
        # Whether the vehicle leans by itself.
        self._leans = False

    @property
    def current(self) -> float:
        """Return the current roll in radians, positive right side down."""
        return min(max(super().current, -TUNING.max_roll), TUNING.max_roll)

    @property
    def on_road(self) -> float:
        """
        Return the current roll relative to the surface of the road, in radians, right side down.

        A roll to the inside of a turn is the bank of the road, unless the vehicle has leaned by
        more than roads do: then it is a two-wheeler. While the roll of the mounting is not known,
        all of it counts, as it may be that of the mounting.
        """
        banked = self._state[1] * self._turning <= 0.0 and not self._leans
        known = self._covariance[0, 0] < TUNING.known_mounting ** 2
        return self.mounting if banked and known else self.current

    def with_mounting(self, horizon: Horizon) -> 'CameraRoll':
        """Return the same roll with another mounting, that of the ``horizon``."""
        other = CameraRoll(horizon, lean=self.current - horizon.roll)
        other._leans, other.yaw_rate = self._leans, self.yaw_rate
        # Just after a gap, the lean is not known.
        other._covariance[1, 1] = max(other._covariance[1, 1], self._covariance[1, 1])
        return other

    def forget_lean(self) -> None:
        """Restart upright, as far as is known; the roll of the mounting is kept."""
        self.yaw_rate = 0.0
        self._forget(TUNING.unseen_lean)

    def miss(self, interval: float, yaw: float = 0.0) -> None:
        """
        Add a pair that does not show the change of the roll; an unknown ``yaw`` is 0.

        The yaw may be wrong, so it can confirm a turn, but not begin one.
        """
        low, high = sorted((0.0, self.yaw_rate * interval))
        self._average(min(max(yaw, low), high), interval)
        self._fade(interval, time=TUNING.unseen_lean_s, deviation=TUNING.unseen_lean)

    def predict(self, interval: float) -> None:
        """Predict ``interval`` seconds ahead."""
        # On a straight, a vehicle is upright: what seems to be a lean is the bank of the road.
        self._fade(interval, time=TUNING.lean_time_s, deviation=TUNING.lean_deviation,
                   lasts=self._turning != 0.0)
        self._covariance[0, 0] += mounting_drift(interval)

    @property
    def _turning(self) -> float:
        """Return the yaw rate in a turn, 0 on a straight."""
        return self.yaw_rate if abs(self.yaw_rate) > TUNING.straight_yaw_rate else 0.0

    def _average(self, yaw: float, interval: float) -> None:
        """Add the yaw of a pair to the mean yaw rate."""
        self.yaw_rate = running_mean(
            self.yaw_rate, yaw / interval, interval, time=TUNING.yaw_rate_s)

    def add(
        self, motion: CameraMotion, interval: float, mounting: Mounting, *, certain: bool = True,
    ) -> float:
        """
        Add the motion of a pair of frames that are ``interval`` seconds apart.

        Return the part of its yaw that comes from a lean, in radians: a camera that points up or
        down sees a part of each lean as yaw. ``mounting`` has the direction of travel. If the
        motion is not ``certain``, only its change of the roll counts, which the next pair may
        take back.
        """
        self._average(motion.yaw, interval)
        # The turn of a camera that is mounted with a pitch is in part a roll, too. A vehicle leans
        # about its direction of travel, so a camera that points aside sees a part as a pitch.
        sine, cosine = math.sin(mounting.angle), math.cos(mounting.angle)
        turned = motion.yaw * (mounting.slope + math.tan(self.current) * sine) / cosine
        leaned = motion.roll - turned
        self._state[1] += leaned
        # While the slope is not known, a share of the turn may seem to be a lean. The shaking of
        # the camera does not: it goes back.
        self._covariance[1, 1] += (
            self.yaw_rate ** 2 * interval * TUNING.slope_error_s * mounting.slope_variance)
        if certain:
            # Linearised by the roll. The yaw of a single pair is in part a shake of the camera,
            # which tells nothing of the roll.
            innovation = motion.nod(self.current) - leaned * sine / cosine
            change = -self.yaw_rate * interval / math.cos(self.current) ** 2
            self._correct(innovation, TUNING.pitch_walk ** 2 * interval, slope=change)
            # Just after a gap, the lean may be wrong by more than a bank.
            doubt = TUNING.lean_deviations * math.sqrt(self._covariance[1, 1])
            self._leans |= (abs(self._state[1]) > TUNING.max_bank + doubt
                            and self._state[1] * self._turning < 0.0)
        # Without the correction above: it concerns an earlier lean, not the motion of this pair.
        return -leaned * mounting.slope / (1.0 + mounting.slope ** 2)
