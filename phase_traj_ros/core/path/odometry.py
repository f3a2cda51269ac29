# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the vehicle is, in metres: the measured heading, and how far it has gone along it."""

from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.path.heading_path import HeadingPath
from phase_traj_ros.core.path.trajectory import Corner
from phase_traj_ros.core.road.travel import Travel

# For how many seconds errors of the way are alike: those of the springs, and of the pitch.
_SWING, _TILT = 1.0, 60.0
# By so much a camera is mounted askew: the axes of the first frame are its own, while the path
# goes where the vehicle goes (standard deviation).
_MOUNTED = math.radians(0.7)
_X, _Y, _YAW, _SWINGS, _TILTS, _SCALES, _ASKEW, _STATES = range(8)

Covariance = tuple[
    tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


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
        The mean of that of x and that of y, in square metres.
    yaw_variance, speed_variance, yaw_rate_variance
        In square radians, and so on.
    covariance
        (3, 3) of x, y and yaw, in the axes of the first frame; square metres and radians.
    """

    pose: Corner
    speed: float
    yaw_rate: float
    position_variance: float
    yaw_variance: float
    speed_variance: float
    yaw_rate_variance: float
    covariance: Covariance


class Odometer:
    """
    Adds up the way along the heading.

    Errors that are independent from pair to pair grow with the root of the way. Those that are
    alike from pair to pair, as of the camera's height, grow with the way itself; so they are
    unknowns of their own, and the covariance of the pose with them is kept.
    """

    def __init__(self, *, max_corners: int | None = None) -> None:
        """Make an odometer that has not started; its path keeps ``max_corners`` places."""
        self.path = HeadingPath(max_corners=max_corners)
        """Where it has been, in metres."""
        self.reset()

    def reset(self) -> None:
        """Go back to the origin and forget the way."""
        self.path.reset()
        self._covariance: NDArray[np.float64] = np.zeros((_STATES, _STATES))
        self._covariance[_ASKEW, _ASKEW] = _MOUNTED ** 2
        self._lost = 0.0

    def update(
        self, step: HeadingStep, travel: Travel, stamp_ns: int, interval: float,
    ) -> Odometry:
        """
        Take the next pair of frames.

        Parameters
        ----------
        step
            What it adds to the heading.
        travel
            What it adds to the way, in metres.
        stamp_ns
            Of its second frame.
        interval
            Seconds since its first one, above 0.

        """
        self.path.append(step.heading, step.yaw, travel.distance, stamp_ns)
        self._grow(step, travel, interval)
        tip = self.path.tip
        assert tip is not None
        covariance = self._covariance
        return Odometry(
            tip, travel.distance / interval, step.yaw / interval,
            position_variance=float(covariance[_X, _X] + covariance[_Y, _Y]) / 2,
            yaw_variance=float(covariance[_YAW, _YAW]),
            speed_variance=travel.variance / interval ** 2,
            yaw_rate_variance=step.variance / interval ** 2,
            covariance=_rows(covariance))

    def miss(self, step: HeadingStep, travel: Travel, interval: float) -> None:
        """
        Take a pair of which the way is not known.

        The pose stays where it is; how far the vehicle may have gone is counted as an error of it,
        to any side.
        """
        self._grow(step, replace(travel, distance=0.0, variance=0.0), interval)
        before, self._lost = self._lost, self._lost + math.sqrt(travel.variance)
        self._covariance[_X, _X] += self._lost ** 2 - before ** 2
        self._covariance[_Y, _Y] += self._lost ** 2 - before ** 2

    def _grow(self, step: HeadingStep, travel: Travel, interval: float) -> None:
        """Let the covariance of the pose grow by the errors of a pair."""
        self._renew(_SWINGS, travel.swing, math.exp(-interval / _SWING))
        self._renew(_TILTS, travel.tilt, math.exp(-interval / _TILT))
        self._renew(_SCALES, travel.scale, 1.0)
        middle = step.heading - step.yaw / 2
        along = np.array([math.cos(middle), math.sin(middle)])
        across = np.array([-along[1], along[0]])
        change = np.eye(_STATES)
        change[:_YAW, _YAW] = travel.distance * across
        change[:_YAW, _SWINGS:_ASKEW] = travel.distance * along[:, None]
        change[:_YAW, _ASKEW] = travel.distance * across
        noise = np.zeros((_STATES, 2))
        noise[:_YAW, 0] = math.sqrt(travel.own_variance) * along
        noise[:_YAW, 1] = math.sqrt(step.variance) * travel.distance / 2 * across
        noise[_YAW, 1] = math.sqrt(step.variance)
        self._covariance = change @ self._covariance @ change.T + noise @ noise.T

    def _renew(self, state: int, deviation: float, kept: float) -> None:
        """Give an error its deviation of now; of what it was before, a share is kept."""
        before = math.sqrt(self._covariance[state, state])
        # A pair that stands has none, and changes nothing but the time.
        deviation = deviation or kept * before
        share = 0.0 if before == 0.0 else kept * deviation / before
        self._covariance[state] *= share
        self._covariance[:, state] *= share
        self._covariance[state, state] = deviation * deviation


def _rows(covariance: NDArray[np.float64]) -> Covariance:
    one, two, three = covariance[:_SWINGS, :_SWINGS].tolist()
    return tuple(one), tuple(two), tuple(three)
