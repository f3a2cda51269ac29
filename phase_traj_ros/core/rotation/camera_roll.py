# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Estimates the current roll of the camera relative to the road.

The roll is the sum of the roll of the mounting and of the lean of the vehicle: in a turn, a car
leans to the outside by a degree or two, a bicycle to the inside by up to 20 degrees. There are two
measurements. First, the blocks show each change of the roll. Second, a vehicle turns about the
vertical axis, so a camera with a roll sees a part of the turn as a pitch.
"""

import math

import numpy as np
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.tuning import TUNING


class CameraRoll:
    """Estimates the roll with a Kalman filter of two states: mounting and lean."""

    def __init__(self, horizon: Horizon, *, lean: float = 0.0) -> None:
        """Start with the roll of a ``horizon``, and with the lean of the vehicle in radians."""
        self._state = np.array([horizon.roll, lean])
        self._covariance = np.diag([horizon.roll_deviation ** 2, TUNING.lean_deviation ** 2])

    @property
    def mounting(self) -> float:
        """Return the roll of the mounting in radians, positive right side down."""
        return float(self._state[0])

    @property
    def lean(self) -> float:
        """Return the lean of the vehicle in radians, positive right side down."""
        return float(self._state[1])

    @property
    def current(self) -> float:
        """Return the current roll in radians, positive right side down."""
        return self.mounting + self.lean

    def forget_lean(self) -> None:
        """Restart upright; the roll of the mounting is kept."""
        self._state[1] = self._covariance[0, 1] = self._covariance[1, 0] = 0.0
        self._covariance[1, 1] = TUNING.lean_deviation ** 2

    def predict(self, interval: float, yaw_rate: float) -> None:
        """Predict ``interval`` seconds ahead, at a yaw rate in radians per second."""
        kept = math.exp(-interval / TUNING.lean_time_s)
        added = (1.0 - kept * kept) * TUNING.lean_deviation ** 2
        if abs(yaw_rate) < TUNING.straight_yaw_rate:
            # On a straight, a vehicle is upright: what seems to be a lean is the bank of the road.
            self._state[1] *= kept
            self._covariance[1] *= kept
            self._covariance[:, 1] *= kept
        self._covariance[1, 1] += added

    def add(self, motion: CameraMotion, interval: float, slope: float) -> None:
        """
        Add the motion of a pair of frames that are ``interval`` seconds apart.

        ``slope`` is that of the horizon in the image, positive down.
        """
        # The turn of a camera that is mounted with a pitch is in part a roll, too.
        self._state[1] += motion.roll - motion.yaw * slope
        # The part of the turn that is a pitch, -yaw tan(roll), linearised.
        roll = min(max(self.current, -TUNING.max_roll), TUNING.max_roll)
        innovation = motion.pitch + motion.yaw * math.tan(roll)
        change = -motion.yaw / math.cos(roll) ** 2
        spread = change * self._covariance.sum(axis=1)
        gain = spread / (change * float(spread.sum()) + TUNING.pitch_walk ** 2 * interval)
        self._state += gain * innovation
        self._covariance -= np.outer(gain, spread)
