# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the odometry, in physical units."""

from dataclasses import dataclass
import math

from phase_traj_ros.core.heading.tuning import TUNING as HEADING


@dataclass(frozen=True, slots=True, kw_only=True)
class PathTuning:
    """
    Tuning of the errors of the odometry; not for users.

    Angles are in radians, times in seconds. Where no source is given, the value was chosen on the
    drives of docs/measurements/distance.md and frame_rate.md.
    """

    suspension_s: float = 1.0
    """Correlation time of the errors of the distance from the suspension: the springs of a car
    swing at about 1 Hz, damped, ..."""
    pitch_s: float = 60.0
    """...of those from the pitch of the camera, ..."""
    yaw_correlation_s: float = 0.25
    """...and of half of the variance of the yaw, as the blocks see the same objects."""
    mounting_deviation: float = math.radians(0.5)
    """Standard deviation of the yaw of the mounted camera: the axes of the first frame are those
    of the camera, while the path follows the vehicle."""
    yaw_scale_deviation: float = 0.01
    """Standard deviation of the scale of all yaws, from the error of a calibration that is given:
    that of a learned camera is added."""
    standing_deviation: float = math.radians(0.01)
    """Standard deviation of the yaw of a standing vehicle."""

    bridged_rate_deviation: float = HEADING.bridged_deviation
    """Standard deviation of the yaw rate of a pair that was not measured, just after a
    measurement, ..."""
    bridged_rate_growth: float = math.radians(20.0)
    """...its growth per second: a car enters a corner with 20 deg/s^2, ..."""
    max_bridged_rate_deviation: float = math.radians(30.0)
    """...and at most."""

    acceleration: float = 3.0
    """Largest acceleration in m/s^2, by which the speed after a gap bounds the distance in it."""

    min_speed_deviation: float = 0.01
    """Least standard deviations that are published, as nothing measured is exact: of the speed, in
    metres per second, ..."""
    min_rate_deviation: float = math.radians(0.01)
    """...and of the yaw rate. The picture of a standing vehicle moves by less."""
    unknown_speed_deviation: float = 1e3
    """Standard deviation of the speed of 0 that stands for an unknown one: no filter counts it."""

    max_speed_age_ns: int = 2_500_000_000
    """Longest time for which a given speed is valid: GPS receivers publish once a second."""


TUNING = PathTuning()
