# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Converts pairs of frames to the input of the locator: steps and interruptions."""

from __future__ import annotations

from dataclasses import dataclass, replace
import math
from typing import TypeAlias

from phase_traj_ros.core import OdometryStep, PairStatus, Update

# Bounds of an unobserved motion: speed in metres per second, yaw rate in radians per second.
_FASTEST = 25.0
_TURNING = 0.5
# A distance that is not measured is bridged by the last speed, with this relative deviation, and
# at least this deviation in units of the odometry per second: a standing vehicle may pull off.
# After so many seconds, a vehicle may have stopped or accelerated.
_SPEED_ERROR = 0.5
_LEAST_SPEED_ERROR = 2.0
_SPEED_LASTS = 5.0


@dataclass(frozen=True, slots=True)
class Interruption:
    """
    An unobserved motion of the vehicle.

    distance
        Largest distance that it may have driven, in metres; infinite if it is unknown.
    turn
        Standard deviation of the change of its heading in radians; pi if it is unknown.
    """

    distance: float
    turn: float

    @classmethod
    def lasting(cls, seconds: float, *, distance: float = 0.0, turn: float = 0.0) -> Interruption:
        """Return an interruption of some seconds, of at least that distance and turn."""
        return cls(max(_FASTEST * seconds, distance), min(max(_TURNING * seconds, turn), math.pi))


ANYWHERE = Interruption(math.inf, math.pi)
"""An interruption of unknown duration, such as a cut in a video or a new drive."""

Motion: TypeAlias = OdometryStep | Interruption


@dataclass(frozen=True, slots=True, kw_only=True)
class MovedPair:
    """
    The measured motion of a pair of frames.

    stamp_ns, interval_ns
        Stamp of the second frame, and time since the first one, in nanoseconds.
    status
        Status of the pair. The motion of a ``REPEATED`` picture belongs to the next pair.
    distance, distance_variance
        Distance in the unit of the odometry, and its variance; None if it is not measured.
    yaw, yaw_variance
        Change of the heading in radians, positive to the left, and its variance.
    cut
        Whether the video has a cut between the two frames.
    """

    stamp_ns: int
    interval_ns: int
    status: PairStatus
    distance: float | None = None
    distance_variance: float = 0.0
    yaw: float = 0.0
    yaw_variance: float = 0.0
    cut: bool = False

    @classmethod
    def of(cls, update: Update) -> MovedPair | None:
        """Return the pair of an update; None if the estimator measures no heading or distance."""
        pair = cls(stamp_ns=update.stamp_ns, interval_ns=update.interval_ns, status=update.status)
        if pair.status is PairStatus.REPEATED:
            return pair
        heading, travel = update.heading, update.travel
        if heading is None or travel is None:
            return None
        return replace(
            pair, distance=travel.distance if travel.measured else None,
            distance_variance=travel.variance, yaw=heading.yaw, yaw_variance=heading.variance,
            cut=update.cut)


class Motions:
    """Converts the successive pairs of a drive, live or offline."""

    def __init__(self) -> None:
        """Start with an unknown speed."""
        self._speed = 0.0
        self._unknown_s = 0.0

    def of(self, pair: MovedPair) -> tuple[Motion, ...]:
        """Return the motions of the next pair, in order, at least one."""
        seconds = pair.interval_ns * 1e-9
        if pair.status is PairStatus.REPEATED:
            return (OdometryStep(stamp_ns=pair.stamp_ns, distance=0.0, yaw=0.0),)
        if pair.cut or pair.status is PairStatus.GAP:
            self._unknown_s = 0.0
            return (ANYWHERE if pair.cut else Interruption.lasting(seconds),)
        before: tuple[Motion, ...] = ()
        distance, variance = pair.distance, pair.distance_variance
        if distance is None:
            distance = self._speed * seconds
            # These pairs share the error of one speed: the deviations add, not the variances.
            deviation = max(_SPEED_ERROR * abs(self._speed), _LEAST_SPEED_ERROR)
            begun_s, self._unknown_s = self._unknown_s, self._unknown_s + seconds
            variance = deviation ** 2 * (self._unknown_s ** 2 - begun_s ** 2)
            if self._unknown_s > _SPEED_LASTS:
                before = (Interruption(_FASTEST * self._unknown_s, 0.0),)
                # The interruption covers this pair, too.
                self._unknown_s = distance = variance = 0.0
        else:
            self._unknown_s = 0.0
            self._speed = distance / seconds if seconds > 0.0 else self._speed
        return (*before, OdometryStep(
            stamp_ns=pair.stamp_ns, distance=distance, yaw=pair.yaw,
            distance_variance=variance, yaw_variance=pair.yaw_variance))
