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

(_X, _Y, _YAW, _SUSPENSION, _PITCH, _SCALE, _MOUNTING_YAW, _YAW_SCALE, _YAW_ERROR,
 _STATE_COUNT) = range(10)

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


class Odometer:
    """
    Integrates the distance along the heading.

    Independent errors grow with the square root of the distance, correlated ones, such as that of
    the camera height, with the distance. So these are separate states.
    """

    def __init__(self, path: HeadingPath) -> None:
        """Make an odometer that has not started, for a path in metres."""
        self._path = path
        self._covariance: NDArray[np.float64] = np.zeros((_STATE_COUNT, _STATE_COUNT))
        self._covariance[_MOUNTING_YAW, _MOUNTING_YAW] = TUNING.mounting_deviation ** 2
        self._covariance[_YAW_SCALE, _YAW_SCALE] = TUNING.yaw_scale_deviation ** 2
        self._scale = 0.0
        # Standard deviation of the distance of missed pairs before the newest speed, and since,
        # with their time.
        self._missed_before = self._missed = self._missed_s = self._bridged_s = 0.0
        self._newest: Odometry | None = None

    def update(
        self, step: HeadingStep, travel: Travel, stamp_ns: int, interval: float, *,
        interval_deviation: float = 0.0,
    ) -> Odometry:
        """
        Add the next pair of frames; return the odometry after it.

        If the distance is unknown, the heading continues and the position stays. The possible
        distance is added to its error in all directions. ``travel`` is in metres,
        ``interval`` in seconds, above 0; rates have the relative error of its standard deviation,
        ``interval_deviation``.
        """
        speed_variance = max(travel.variance / interval ** 2, TUNING.min_speed_deviation ** 2)
        if travel.known:
            self._bound_missed(abs(travel.distance) / interval)
        else:
            speed_variance = TUNING.unknown_speed_deviation ** 2
            self._missed_s += interval
            self._set_missed(self._missed + math.sqrt(travel.variance))
            travel = replace(travel, distance=0.0, variance=0.0)
        tip = self._path.append(step.heading, step.yaw, travel.distance, stamp_ns)
        self._propagate(step, travel, interval)
        speed, (rate, rate_variance) = travel.distance / interval, self._rate(step, interval)
        relative_variance = (interval_deviation / interval) ** 2
        self._newest = Odometry(
            tip, speed, rate,
            speed_variance=speed_variance + relative_variance * speed ** 2,
            yaw_rate_variance=rate_variance + relative_variance * rate ** 2,
            covariance=covariance_rows(self._covariance[:_SUSPENSION, :_SUSPENSION]))
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
            covariance=covariance_rows(
                self._covariance[:_SUSPENSION, :_SUSPENSION] + np.diag(variances)),
            yaw_rate_variance=self._newest.yaw_rate_variance + (step.foreseen / interval) ** 2)

    def _bound_missed(self, speed: float) -> None:
        """Bound the error of the missed pairs by the speed after them."""
        if self._missed_s > 0.0:
            farthest = (speed + TUNING.acceleration * self._missed_s) * self._missed_s
            self._set_missed(min(self._missed, farthest))
            self._missed_before += self._missed
            self._missed = self._missed_s = 0.0

    def _set_missed(self, missed: float) -> None:
        """Set the standard deviation of the distance of the newest missed pairs."""
        # The errors of missed pairs are fully correlated.
        grown = (self._missed_before + missed) ** 2 - (self._missed_before + self._missed) ** 2
        self._covariance[_X, _X] += grown
        self._covariance[_Y, _Y] += grown
        self._missed = missed

    def _rate(self, step: HeadingStep, interval: float) -> tuple[float, float]:
        """Return the yaw rate of a pair and its variance."""
        if not step.bridged:
            self._bridged_s = 0.0
            own = max(step.variance / interval ** 2, TUNING.min_rate_deviation ** 2)
            return step.rate, own + self._covariance[_YAW_SCALE, _YAW_SCALE] * step.rate ** 2
        self._bridged_s += interval
        rate = step.yaw / interval
        # The vehicle may have been steered since the newest measurement.
        deviation = TUNING.bridged_rate_deviation + TUNING.bridged_rate_growth * self._bridged_s
        deviation = min(deviation, TUNING.max_bridged_rate_deviation)
        return rate, deviation ** 2 + (step.rate - rate) ** 2

    def _propagate(self, step: HeadingStep, travel: Travel, interval: float) -> None:
        """Propagate the covariance by a pair and add its errors."""
        self._set_correlated(_SUSPENSION, travel.swing, math.exp(-interval / TUNING.suspension_s))
        self._set_correlated(_PITCH, travel.tilt, math.exp(-interval / TUNING.pitch_s))
        if step.scale != self._scale:
            self._scale = step.scale
            self._refine_constant(_YAW_SCALE, math.hypot(TUNING.yaw_scale_deviation, step.scale))
            if 0.0 < travel.scale ** 2 < self._covariance[_SCALE, _SCALE]:
                self._refine_constant(_SCALE, travel.scale)
        self._set_correlated(_SCALE, travel.scale, 1.0)
        turn = step.variance / 2
        if travel.state is TravelState.STANDING:
            turn = min(turn, TUNING.standing_deviation ** 2)
        # All pairs of one keyframe share this error of the rate.
        correlation = math.exp(-interval / TUNING.yaw_correlation_s)
        self._set_correlated(_YAW_ERROR, math.sqrt(step.share * turn), correlation)
        middle = step.heading - step.yaw / 2
        along = np.array([math.cos(middle), math.sin(middle)])
        across = np.array([-along[1], along[0]])
        change = np.eye(_STATE_COUNT)
        change[:_YAW, _YAW] = travel.distance * across
        change[:_YAW, _SUSPENSION:_MOUNTING_YAW] = travel.distance * along[:, None]
        change[:_YAW, _MOUNTING_YAW] = travel.distance * across
        for state, effect in ((_YAW_SCALE, step.yaw), (_YAW_ERROR, 1.0)):
            change[:_YAW, state] = effect * travel.distance / 2 * across
            change[_YAW, state] = effect
        noise = np.zeros((_STATE_COUNT, 3))
        noise[_YAW, 2] = step.missed
        noise[:_YAW, 0] = math.sqrt(travel.own_variance) * along
        noise[:_YAW, 1] = math.sqrt(turn) * travel.distance / 2 * across
        noise[_YAW, 1] = math.sqrt(turn)
        self._covariance = change @ self._covariance @ change.T + noise @ noise.T

    def _refine_constant(self, state: int, deviation: float) -> None:
        """
        Set the deviation of a constant error after a change of the camera estimate.

        The yaw so far is corrected by the better estimate of the angles, the positions are not.
        The errors of both estimates have the variance of the later one in common.
        """
        before, after = self._covariance[state, state], deviation ** 2
        kept = min(after / before, 1.0)
        effect = self._covariance[_YAW, state] / before if state == _YAW_SCALE else 0.0
        change, news = np.eye(_STATE_COUNT), np.zeros(_STATE_COUNT)
        change[_YAW, state], change[state, state] = (kept - 1.0) * effect, kept
        news[_YAW], news[state] = effect, 1.0
        self._covariance = change @ self._covariance @ change.T + (
            after - kept * kept * before) * np.outer(news, news)

    def _set_correlated(self, state: int, deviation: float, kept: float) -> None:
        """Set the deviation of an error, of which the share ``kept`` remains from before."""
        before = math.sqrt(self._covariance[state, state])
        # A standing pair has no deviation of its own.
        deviation = deviation or kept * before
        share = 0.0 if before == 0.0 else kept * deviation / before
        self._covariance[state] *= share
        self._covariance[:, state] *= share
        self._covariance[state, state] = deviation * deviation


def covariance_rows(covariance: NDArray[np.float64]) -> Covariance:
    """Return a planar covariance, (3, 3), as immutable rows."""
    row_x, row_y, row_yaw = covariance.tolist()
    return tuple(row_x), tuple(row_y), tuple(row_yaw)
