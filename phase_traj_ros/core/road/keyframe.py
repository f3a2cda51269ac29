# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The frame with which the road is compared, and the motion of the camera since."""

from dataclasses import dataclass

from phase_traj_ros.core.road.speed_filter import SpeedFilter
from phase_traj_ros.core.road.tuning import TUNING


@dataclass(slots=True)
class RoadKeyframe:
    """Time, rotation and distance since the keyframe, in seconds, radians and camera heights."""

    age: float = 0.0
    yaw: float = 0.0
    """Positive to the left."""
    pitch: float = 0.0
    roll: float = 0.0
    passing: float = 0.0
    """Sum of the ratios of translation to distance of the near blocks."""
    agreed: bool = False
    """Whether the blocks agree on the motion of the newest pair."""
    given: float = 0.0
    """Sum of the distances of the pairs since."""
    variance: float = 0.0
    before: float = 0.0
    """The same without the newest pair, and its variance."""
    before_variance: float = 0.0
    over: bool = False
    """Whether the newest frame becomes the keyframe."""

    def turn(
        self, yaw: float, pitch: float, roll: float, interval: float, near: float | None = None,
    ) -> None:
        """Add the rotation of a pair, and its ratio of translation to distance, if it has one."""
        self.agreed = near is not None
        self.passing += near or 0.0
        self.yaw += yaw
        self.pitch += pitch
        self.roll += roll
        self.age += interval

    @property
    def nodding(self) -> float:
        """Return the standard deviation of the pitch in radians."""
        return TUNING.nodding if self.agreed else TUNING.springs

    @property
    def moves(self) -> bool:
        """Return whether the vehicle moves, independent of the road."""
        return not self.agreed or self.passing > TUNING.passing

    @property
    def drives(self) -> bool:
        """Return whether the road must have slid, so that what has not is not the road."""
        return not self.agreed or self.passing > TUNING.driven

    @property
    def least(self) -> float:
        """Return the least slide of the road in camera heights, by what the blocks show."""
        return TUNING.nearest * self.passing if self.agreed and self.drives else 0.0

    @property
    def swings(self) -> bool:
        """Return whether the vehicle turns as only one that drives can."""
        return abs(self.yaw) > TUNING.turning * self.age

    def is_far(self, way: float, interval: float) -> bool:
        """Return whether a frame ``interval`` seconds later would be too far from this one."""
        further = 1.0 + interval / self.age
        return (further * abs(way) > TUNING.baseline or self.age >= TUNING.longest
                or abs(self.yaw) > TUNING.turned)

    def add(
        self, way: float, variance: float, speeds: SpeedFilter, interval: float,
    ) -> tuple[float, float]:
        """
        Return the distance of the newest pair and its variance, from that since the keyframe.

        Up to the last pair before a new keyframe, it is smoothed with the speed. The sum of all
        is the distance between the keyframes.
        """
        self.before, self.before_variance = self.given, self.variance
        if self.over or not speeds.known:
            self.given, self.variance = way, variance
            return self.given - self.before, variance
        foreseen = self.before + speeds.speed * interval
        off = self.before_variance + (speeds.seen_deviation * interval) ** 2
        gain = off / (off + variance)
        self.given, self.variance = foreseen + gain * (way - foreseen), gain * variance
        return self.given - self.before, (speeds.seen_deviation * interval) ** 2

    def bridge(self, way: float, variance: float) -> None:
        """Add the distance of a pair that is not measured, and its variance."""
        self.given += way
        self.variance += variance
