# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the vehicle is, in metres: the measured heading, and a speed from elsewhere."""

from dataclasses import dataclass
import math

from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.path.heading_path import HeadingPath
from phase_traj_ros.core.path.trajectory import Corner

# What a pair's yaw is off by (docs/measurements/heading.md, rounded up), what the yaw rate of a
# bridged pair may be off by, and the speed, as a share of it: standard deviations.
_YAW = math.radians(0.1)
_BRIDGED_RATE = math.radians(5.0)
_SPEED_SHARE = 0.05


@dataclass(frozen=True, slots=True)
class Odometry:
    """
    Pose and motion after a pair of frames, relative to the first frame, in REP 103 axes.

    pose
        Metres and radians.
    speed
        Metres per second, the mean of the pair, negative in reverse.
    yaw_rate
        Radians per second, left positive.
    position_variance
        Of x and of y, in square metres.
    yaw_variance, speed_variance, yaw_rate_variance
        In square radians, and so on.
    """

    pose: Corner
    speed: float
    yaw_rate: float
    position_variance: float
    yaw_variance: float
    speed_variance: float
    yaw_rate_variance: float


class Odometer:
    """
    Adds up the way along the heading.

    The variances are what errors of the yaw that are independent from pair to pair, and a speed
    that is some percent off, make of the pose; a heading whose scale is wrong is not among them.
    """

    def __init__(self, *, max_corners: int | None = None) -> None:
        """Make an odometer that has not started; its path keeps ``max_corners`` places."""
        self.path = HeadingPath(max_corners=max_corners)
        """Where it has been, in metres."""
        self.reset()

    def reset(self) -> None:
        """Go back to the origin and forget the way."""
        self.path.reset()
        self._way = 0.0
        self._speed = 0.0
        self._lost = 0.0
        self._yaw_variance = 0.0

    def update(
        self, step: HeadingStep, distance: float, stamp_ns: int, interval: float,
    ) -> Odometry:
        """
        Take the next pair of frames.

        Parameters
        ----------
        step
            What it adds to the heading.
        distance
            What it adds to the way, in metres, negative in reverse.
        stamp_ns
            Of its second frame.
        interval
            Seconds since its first one, above 0.

        """
        self.path.append(step.heading, step.yaw, distance, stamp_ns)
        self._way += abs(distance)
        off = self._turn(step, interval)
        speed = self._speed = distance / interval
        tip = self.path.tip
        assert tip is not None
        return Odometry(
            tip, speed, step.yaw / interval,
            position_variance=(
                self._way ** 2 * (_SPEED_SHARE ** 2 + self._yaw_variance / 3)
                + self._lost ** 2),
            yaw_variance=self._yaw_variance,
            speed_variance=(_SPEED_SHARE * speed) ** 2,
            yaw_rate_variance=(off / interval) ** 2)

    def miss(self, step: HeadingStep, interval: float) -> None:
        """
        Take a pair of which the way is not known.

        The pose stays where it is; how far the vehicle has gone meanwhile at the last speed is
        counted as an error of it.
        """
        self._turn(step, interval)
        self._lost += abs(self._speed) * interval

    def _turn(self, step: HeadingStep, interval: float) -> float:
        """Count the error of a pair's yaw; return its standard deviation."""
        off = _BRIDGED_RATE * interval if step.bridged else _YAW
        self._yaw_variance += off * off
        return off
