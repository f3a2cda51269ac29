# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The focus of expansion: the direction of travel relative to the camera.

A camera is mounted at a small azimuth to the vehicle. A prior of travel straight ahead of the
camera would turn a share of this angle into yaw in each pair, always in one direction. So the
azimuth is estimated from the direction of travel on straights. So is the slope: it is the pitch of
the camera, with which a part of each turn is not a yaw but a roll of the camera.
"""

from dataclasses import dataclass, replace
import math

from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.swaying_angle import mounting_drift
from phase_traj_ros.core.rotation.tuning import TUNING


@dataclass(frozen=True, slots=True)
class FocusOfExpansion:
    """Direction of travel relative to the camera: azimuth and slope in radians, and variances."""

    course: float = 0.0
    slope: float = 0.0
    course_variance: float = TUNING.course_deviation ** 2 + TUNING.mounting_deviation ** 2
    slope_variance: float = TUNING.slope_deviation ** 2

    def predict(
        self, interval: float, yaw_rate: float, mounting: 'Mounting',
    ) -> 'FocusOfExpansion':
        """
        Return the prediction ``interval`` seconds later, at a yaw rate in radians per second.

        The course tends to that of the ``mounting``; the faster the vehicle turns, the less
        certain it is. The slope stays, as it is mostly that of the mounting; a tendency to 0 would
        bias each pair.
        """
        kept = math.exp(-interval / TUNING.course_time_s)
        share = kept * kept
        course = math.hypot(
            TUNING.course_deviation, mounting.deviation, TUNING.sideslip_s * yaw_rate)
        return FocusOfExpansion(
            kept * self.course + (1.0 - kept) * mounting.angle, self.slope,
            share * self.course_variance + (1.0 - share) * course ** 2,
            share * self.slope_variance + (1.0 - share) * TUNING.slope_deviation ** 2)

    def limited(self, yaw_rate: float, mounting: 'Mounting') -> 'FocusOfExpansion':
        """
        Return it with the nearest course that is plausible at a yaw rate in radians per second.

        Plausible are the course on a straight and, in a turn, one towards its inside, as a camera
        ahead of the rear axle moves there.
        """
        aside = TUNING.course_deviations * math.hypot(TUNING.course_deviation, mounting.deviation)
        # A vehicle slips by a right angle at most.
        inside = -TUNING.course_deviations * TUNING.sideslip_s * yaw_rate
        inside = min(max(inside, -math.pi / 2), math.pi / 2)
        least = mounting.angle - aside + min(inside, 0.0)
        most = mounting.angle + aside + max(inside, 0.0)
        return replace(self, course=min(max(self.course, least), most))


class Mounting:
    """The direction of travel, relative to the camera, of a vehicle that drives straight ahead."""

    def __init__(self, horizon: Horizon | None = None) -> None:
        """Start with a camera that points straight ahead, with the tilt ``horizon``."""
        horizon = horizon or Horizon()
        self.forget_azimuth()
        self.slope = -math.tan(horizon.pitch)
        """Slope, positive down: that of the horizon in the image."""
        self.slope_variance = horizon.pitch_deviation ** 2
        """Variance of the slope."""

    def forget_azimuth(self) -> None:
        """Forget the azimuth; the slope is kept."""
        self.angle = 0.0
        """Azimuth in radians, positive to the right."""
        self._variance = TUNING.mounting_deviation ** 2

    @property
    def deviation(self) -> float:
        """Return the standard deviation of the azimuth in radians."""
        return math.sqrt(self._variance)

    @property
    def level(self) -> float:
        """
        Return the cosine of the pitch of the camera, relative to the direction of travel.

        A camera that is tilted up or down measures only this share of a turn as yaw.
        """
        return math.cos(math.atan(self.slope))

    @property
    def straight_ahead(self) -> FocusOfExpansion:
        """Return the direction of travel straight ahead."""
        return FocusOfExpansion(
            self.angle, self.slope, TUNING.course_deviation ** 2 + self._variance,
            TUNING.slope_deviation ** 2 + self.slope_variance)

    def add(self, travel: FocusOfExpansion, interval: float, yaw_rate: float) -> None:
        """
        Add the direction of travel of a pair of frames.

        ``interval`` is the time between the frames in seconds, above 0. Turns, by the ``yaw_rate``
        in radians per second, are ignored, as the camera moves sideways.
        """
        drift = mounting_drift(interval)
        self._variance += drift
        self.slope_variance += drift
        if abs(yaw_rate) > TUNING.straight_yaw_rate:
            return
        pairs = max(TUNING.course_time_s / interval, 1.0)
        self.angle, self._variance = _filtered(
            self.angle, self._variance, travel.course,
            (TUNING.course_deviation ** 2 + travel.course_variance) * pairs)
        self.slope, self.slope_variance = _filtered(
            self.slope, self.slope_variance, travel.slope,
            (TUNING.slope_deviation ** 2 + travel.slope_variance) * pairs)


def _filtered(state: float, variance: float, measured: float, noise: float) -> tuple[float, float]:
    """Return a state and its variance after a measurement with the variance ``noise``."""
    gain = variance / (variance + noise)
    return state + gain * (measured - state), variance * (1.0 - gain)
