# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Metric odometry of the vehicle from the measured heading and distance."""

from dataclasses import dataclass, replace
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.path.heading_path import HeadingPath
from phase_traj_ros.core.path.trajectory import Corner
from phase_traj_ros.core.path.tuning import TUNING
from phase_traj_ros.core.road.travel import Travel, TravelState

_X, _Y, _YAW, _SWINGS, _TILTS, _SCALES, _ASKEW, _ANGLES, _TURNS, _STATES = range(10)

Covariance = tuple[
    tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


@dataclass(frozen=True, slots=True)
class Odometry:
    """
    Pose and motion after a pair of frames, relative to the first frame, in REP 103 axes.

    pose
        Pose in metres and radians.
    speed
        Mean speed of the pair in metres per second, negative in reverse.
    yaw_rate
        Yaw rate in radians per second, positive to the left. It is that of the pair: a correction
        of earlier pairs, which changes the yaw of the pose, is not a motion.
    speed_variance, yaw_rate_variance
        Variances in the squares of the units above.
    covariance
        Covariance of x, y and yaw, (3, 3), in the axes of the first frame, metres and radians.
    """

    pose: Corner
    speed: float
    yaw_rate: float
    speed_variance: float
    yaw_rate_variance: float
    covariance: Covariance

    @property
    def position_variance(self) -> float:
        """Return the mean of the variances of x and y, in square metres."""
        return (self.covariance[0][0] + self.covariance[1][1]) / 2

    @property
    def yaw_variance(self) -> float:
        """Return the variance of the yaw, in square radians."""
        return self.covariance[2][2]


class Odometer:
    """
    Integrates the distance along the heading.

    Errors that are independent from pair to pair grow with the square root of the distance. Errors
    that are correlated between pairs, such as that of the camera height, grow with the distance.
    They are therefore separate states, whose covariance with the pose is tracked.
    """

    def __init__(self, path: HeadingPath) -> None:
        """Make an odometer that has not started, for a path in metres."""
        self._path = path
        self.reset()

    def reset(self) -> None:
        """Go back to the origin and forget the path."""
        self._path.reset()
        self._covariance: NDArray[np.float64] = np.zeros((_STATES, _STATES))
        self._covariance[_ASKEW, _ASKEW] = TUNING.mounting_deviation ** 2
        self._covariance[_ANGLES, _ANGLES] = TUNING.angle_share ** 2
        self._scale = 0.0
        # Standard deviation of the distance of missed pairs, and that of those since the newest
        # speed, with their time.
        self._lost = self._unseen = self._unseen_s = self._blind = 0.0
        self._newest: Odometry | None = None

    def update(
        self, step: HeadingStep, travel: Travel, stamp_ns: int, interval: float, *,
        unsure: float = 0.0,
    ) -> Odometry:
        """
        Add the next pair of frames; return the odometry after it.

        Where the distance is unknown, the heading goes on and the position stays. What the vehicle
        may have travelled is added to its error, in all directions. ``travel`` is in metres,
        ``interval`` in seconds, above 0; rates have the relative error of its standard deviation,
        ``unsure``.
        """
        speed_variance = travel.variance / interval ** 2
        if travel.known:
            self._bound(abs(travel.distance) / interval)
        else:
            self._unseen_s += interval
            self._lose(self._unseen + math.sqrt(travel.variance))
            travel = replace(travel, distance=0.0, variance=0.0)
        tip = self._path.append(step.heading, step.yaw, travel.distance, stamp_ns)
        self._grow(step, travel, interval)
        speed, (rate, rate_variance) = travel.distance / interval, self._rate(step, interval)
        off = (unsure / interval) ** 2
        self._newest = Odometry(
            tip, speed, rate,
            speed_variance=max(speed_variance, TUNING.least_speed ** 2) + off * speed ** 2,
            yaw_rate_variance=rate_variance + off * rate ** 2,
            covariance=_rows(self._covariance))
        return self._newest

    def foresee(
        self, step: HeadingStep, travel: Travel, stamp_ns: int, interval: float,
    ) -> Odometry:
        """
        Return the odometry of a frame that is not measured; the next pair replaces it.

        ``step`` and ``travel`` are those since the newest pair, ``interval`` seconds before.
        """
        assert self._newest is not None
        variances = [travel.variance, travel.variance, step.variance + step.foreseen ** 2]
        return replace(
            self._newest,
            pose=self._path.foresee(step.heading, step.yaw, travel.distance, stamp_ns),
            covariance=_rows(self._covariance[:_SWINGS, :_SWINGS] + np.diag(variances)),
            yaw_rate_variance=self._newest.yaw_rate_variance + (step.foreseen / interval) ** 2)

    def _bound(self, speed: float) -> None:
        """Bound the error of the missed pairs by the speed after them."""
        if self._unseen_s > 0.0:
            farthest = (speed + TUNING.acceleration * self._unseen_s) * self._unseen_s
            self._lose(min(self._unseen, farthest))
            self._lost += self._unseen
            self._unseen = self._unseen_s = 0.0

    def _lose(self, unseen: float) -> None:
        """Set the standard deviation of the distance of the newest missed pairs."""
        # All that is missing is missing in the same direction.
        grown = (self._lost + unseen) ** 2 - (self._lost + self._unseen) ** 2
        self._covariance[_X, _X] += grown
        self._covariance[_Y, _Y] += grown
        self._unseen = unseen

    def _rate(self, step: HeadingStep, interval: float) -> tuple[float, float]:
        """Return the yaw rate of a pair and its variance."""
        if not step.bridged:
            self._blind = 0.0
            own = max(step.variance / interval ** 2, TUNING.least_rate ** 2)
            return step.rate, own + self._covariance[_ANGLES, _ANGLES] * step.rate ** 2
        self._blind += interval
        rate = step.yaw / interval
        # It may be what it was before, or the vehicle may have been steered since.
        off = TUNING.blind_rate + TUNING.blind_growth * self._blind
        off = min(off, TUNING.most_blind_rate)
        return rate, off ** 2 + (step.rate - rate) ** 2

    def _grow(self, step: HeadingStep, travel: Travel, interval: float) -> None:
        """Propagate the covariance by a pair and add its errors."""
        self._renew(_SWINGS, travel.swing, math.exp(-interval / TUNING.swing_s))
        self._renew(_TILTS, travel.tilt, math.exp(-interval / TUNING.tilt_s))
        if step.scale != self._scale:
            self._scale = step.scale
            self._improve(_ANGLES, math.hypot(TUNING.angle_share, step.scale))
            if 0.0 < travel.scale ** 2 < self._covariance[_SCALES, _SCALES]:
                self._improve(_SCALES, travel.scale)
        self._renew(_SCALES, travel.scale, 1.0)
        turn = step.variance / 2
        if travel.state is TravelState.STANDING:
            turn = min(turn, TUNING.standing_deviation ** 2)
        # In all pairs since one keyframe, it is the same error of the rate.
        self._renew(
            _TURNS, math.sqrt(step.share * turn), math.exp(-interval / TUNING.alike_s))
        middle = step.heading - step.yaw / 2
        along = np.array([math.cos(middle), math.sin(middle)])
        across = np.array([-along[1], along[0]])
        change = np.eye(_STATES)
        change[:_YAW, _YAW] = travel.distance * across
        change[:_YAW, _SWINGS:_ASKEW] = travel.distance * along[:, None]
        change[:_YAW, _ASKEW] = travel.distance * across
        for state, turned in ((_ANGLES, step.yaw), (_TURNS, 1.0)):
            change[:_YAW, state] = turned * travel.distance / 2 * across
            change[_YAW, state] = turned
        noise = np.zeros((_STATES, 3))
        noise[_YAW, 2] = step.missed
        noise[:_YAW, 0] = math.sqrt(travel.own_variance) * along
        noise[:_YAW, 1] = math.sqrt(turn) * travel.distance / 2 * across
        noise[_YAW, 1] = math.sqrt(turn)
        self._covariance = change @ self._covariance @ change.T + noise @ noise.T

    def _improve(self, state: int, deviation: float) -> None:
        """
        Set the deviation of a lasting error, as another camera is used from now on.

        The yaw so far is mended by what is learned of the angles, the places are not. The errors
        of an estimate and of a better one after it have the variance of the latter in common.
        """
        before, after = self._covariance[state, state], deviation ** 2
        kept = min(after / before, 1.0)
        turned = self._covariance[_YAW, state] / before if state == _ANGLES else 0.0
        change, news = np.eye(_STATES), np.zeros(_STATES)
        change[_YAW, state], change[state, state] = (kept - 1.0) * turned, kept
        news[_YAW], news[state] = turned, 1.0
        self._covariance = change @ self._covariance @ change.T + (
            after - kept * kept * before) * np.outer(news, news)

    def _renew(self, state: int, deviation: float, kept: float) -> None:
        """Set the deviation of an error, of which the share ``kept`` remains from before."""
        before = math.sqrt(self._covariance[state, state])
        # A standing pair has no deviation; only time passes.
        deviation = deviation or kept * before
        share = 0.0 if before == 0.0 else kept * deviation / before
        self._covariance[state] *= share
        self._covariance[:, state] *= share
        self._covariance[state, state] = deviation * deviation


def _rows(covariance: NDArray[np.float64]) -> Covariance:
    one, two, three = covariance[:_SWINGS, :_SWINGS].tolist()
    return tuple(one), tuple(two), tuple(three)
