# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Estimates the current pitch of the camera relative to the road.

The pitch is the sum of the pitch of the mounting, which changes with the load only, and that of
the suspension when the vehicle brakes, accelerates or bounces. There are two measurements of the
sum. First, the vehicle moves along the road, so the angle of the direction of travel above the
optical axis is the pitch. Second, with an error e of the pitch, a point z camera heights ahead is
mapped (1 + z**2) e too far, and a slide s there is measured as s (1 + 2 z e). With the correct
pitch, the slides of the near and the far road agree.
"""

import math

from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.swaying_angle import mounting_drift, SwayingAngle
from phase_traj_ros.core.rotation.tuning import TUNING


class CameraPitch(SwayingAngle):
    """Estimates the pitch, positive down, with a Kalman filter over mounting and suspension."""

    def __init__(self, horizon: Horizon) -> None:
        """Start with the prior pitch of a ``horizon``."""
        super().__init__(horizon.pitch, deviation=horizon.pitch_deviation,
                         sway_deviation=TUNING.suspension_pitch)

    @property
    def deviation(self) -> float:
        """Return the standard deviation of the current pitch."""
        return math.sqrt(max(float(self._covariance.sum()), 0.0))

    @property
    def swing_deviation(self) -> float:
        """Return the standard deviation of the part that changes within about a second."""
        return self._deviation_of(1)

    @property
    def common_deviation(self) -> float:
        """Return the standard deviation of the part that changes slowly, the mounting."""
        return math.hypot(self._deviation_of(0), TUNING.common_pitch_error)

    def predict(self, interval: float) -> None:
        """Predict ``interval`` seconds ahead."""
        self._fade(interval, time=TUNING.suspension_time, deviation=TUNING.suspension_pitch)
        self._covariance[0, 0] += mounting_drift(interval)

    def forget_suspension(self) -> None:
        """Restart without a pitch of the suspension; that of the mounting is kept."""
        self._forget(TUNING.suspension_pitch)

    def nod(self, angle: float, deviation: float) -> None:
        """Add a measured change of the pitch in radians, positive nose up."""
        self._state[1] -= angle
        self._covariance[1, 1] += deviation ** 2

    def add_slides(self, ratio: float, apart: float, variance: float, *, assumed: float) -> None:
        """
        Add the ratio of the slides of the far and the near road, with its variance.

        The patches are ``apart`` camera heights from each other. If the slides are equal, the
        current pitch is ``assumed``, in radians.
        """
        steep = 2.0 * apart
        self.add(assumed + math.log(max(ratio, 1e-3)) / steep, variance / (steep * steep))

    def add(self, pitch: float, variance: float) -> None:
        """Add a measured pitch in radians, positive down, with its variance."""
        self._correct(pitch - self.current, variance)

    def _deviation_of(self, part: int) -> float:
        """Return the contribution of the mounting (0) or the suspension (1) to the deviation."""
        # Only the sum is measured, so the errors of both parts mostly cancel. Each contributes its
        # covariance with the sum.
        return math.sqrt(max(float(self._covariance[part].sum()), 0.0))
