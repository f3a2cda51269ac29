# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The inputs of the locator: steps of an odometry, the scale, a prior, and position fixes.

Positions are in the metres of the map, x to the east and y to the north. Headings are in radians,
counter-clockwise from the east.
"""

from dataclasses import dataclass
import math

import numpy as np

# Largest variance of a fix in square metres: a standard deviation of 1000 km.
_MOST_VARIANCE = 1e12
# Standard deviation of the logarithm of a scale that is given exactly.
_LEAST_DEVIATION = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryStep:
    """
    Motion of the vehicle between two consecutive poses of an odometry.

    stamp_ns
        Stamp of the second pose, in nanoseconds.
    distance
        Distance along the path, negative in reverse, in the unit of the odometry, such as metres
        or camera heights.
    yaw
        Change of the heading in radians, positive to the left.
    distance_variance
        Variance of the distance in squares of its unit, independent of other steps.
    yaw_variance
        Variance of the yaw in square radians.
    scale_variance
        Variance of the change of the logarithm of the scale during the step, in addition to the
        default drift of 1 % per root of 100 m.
    """

    stamp_ns: int
    distance: float
    yaw: float
    distance_variance: float = 0.0
    yaw_variance: float = 0.0
    scale_variance: float = 0.0

    def __post_init__(self) -> None:
        """
        Check the numbers.

        Raises
        ------
        ValueError
            A number is not finite, or a variance is negative.

        """
        variances = (self.distance_variance, self.yaw_variance, self.scale_variance)
        if not all(map(math.isfinite, (self.distance, self.yaw, *variances))):
            raise ValueError(
                f'distance and yaw are {self.distance} and {self.yaw}, the variances {variances}:'
                ' give finite numbers, or report the interruption')
        if min(variances) < 0.0:
            raise ValueError(f'the variances are {variances}: give 0 or more')

    def parts(self, count: int) -> list['OdometryStep']:
        """Return the step in equal parts that follow its arc, at least one."""
        # The chord of an arc is proportional to the sine of half its angle.
        whole, part = (float(np.sinc(self.yaw / n / math.tau)) for n in (1, count))
        share = part / whole if abs(self.yaw) <= math.pi else 1.0
        return count * [OdometryStep(
            stamp_ns=self.stamp_ns, distance=share * self.distance / count, yaw=self.yaw / count,
            distance_variance=self.distance_variance / count,
            yaw_variance=self.yaw_variance / count, scale_variance=self.scale_variance / count)]

    @classmethod
    def between(
        cls, before: tuple[float, float, float], after: tuple[float, float, float], *,
        stamp_ns: int,
    ) -> 'OdometryStep':
        """
        Return the step between two planar poses, each x, y and yaw in radians.

        The distance is that along the mean heading: the length of the chord of an arc, negative in
        reverse. Noise across the heading would make the chord longer.
        """
        dx, dy = after[0] - before[0], after[1] - before[1]
        yaw = math.remainder(after[2] - before[2], math.tau)
        middle = before[2] + yaw / 2
        return cls(
            stamp_ns=stamp_ns, distance=dx * math.cos(middle) + dy * math.sin(middle), yaw=yaw)


@dataclass(frozen=True, slots=True)
class ScaleRange:
    """
    Range of the scale, the metres per unit of the odometry; it holds 95 % of the probability.

    ``ScaleRange(0.9, 1.1)`` is for an odometry in metres with a standard deviation of 5 %,
    ``ScaleRange(1.1, 2.2)`` for one in heights of a car camera whose height is unknown.
    """

    least: float = 0.9
    most: float = 1.1

    def __post_init__(self) -> None:
        """
        Check the range.

        Raises
        ------
        ValueError
            The range is empty, or a bound is not positive and finite.

        """
        if not 0.0 < self.least <= self.most < math.inf:
            raise ValueError(
                f'the scale is from {self.least} to {self.most}: give two positive numbers, the'
                ' smaller one first')

    @property
    def middle(self) -> float:
        """Return the geometric mean of the range, in metres per unit."""
        return math.sqrt(self.least * self.most)

    @property
    def log_deviation(self) -> float:
        """Return the standard deviation of the natural logarithm of the scale, at least 1e-6."""
        return max(math.log(self.most / self.least) / 2 / 1.96, _LEAST_DEVIATION)


@dataclass(frozen=True, slots=True)
class Prior:
    """
    Where the vehicle starts: anywhere within a radius around a point.

    x, y, radius
        The point and the radius in metres of the map.
    """

    x: float
    y: float
    radius: float

    def __post_init__(self) -> None:
        """
        Check the numbers.

        Raises
        ------
        ValueError
            The point is not finite, or the radius is not positive and finite.

        """
        if not (math.isfinite(self.x) and math.isfinite(self.y)):
            raise ValueError(f'the prior is at ({self.x}, {self.y}): give finite metres')
        if not 0.0 < self.radius < math.inf:
            raise ValueError(f'the radius is {self.radius}: give positive metres')


@dataclass(frozen=True, slots=True)
class PositionFix:
    """
    A measured position, such as that of a GPS receiver.

    x, y
        Position in metres of the map.
    variance_x, variance_y
        Variances in square metres.
    covariance_xy
        Covariance of x and y in square metres.
    stamp_ns
        Stamp in nanoseconds on the clock of the odometry; None for that of the newest pose.
    """

    x: float
    y: float
    variance_x: float
    variance_y: float
    covariance_xy: float = 0.0
    stamp_ns: int | None = None

    def __post_init__(self) -> None:
        """
        Check the numbers.

        Raises
        ------
        ValueError
            A number is not finite, the covariance is not positive definite, or a variance is above
            1e12.

        """
        numbers = (self.x, self.y, self.variance_x, self.variance_y, self.covariance_xy)
        if not all(map(math.isfinite, numbers)):
            raise ValueError(f'the fix is {numbers}: give finite numbers, or leave out the fix')
        if (min(self.variance_x, self.variance_y) <= 0.0
                or max(self.variance_x, self.variance_y) > _MOST_VARIANCE
                or self.covariance_xy ** 2 >= self.variance_x * self.variance_y):
            raise ValueError(
                f'the covariance of the fix is {numbers[2:]}: give positive variances up to'
                f' {_MOST_VARIANCE:g}, and a covariance below the root of their product')
