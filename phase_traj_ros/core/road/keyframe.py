# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The motion of the camera since the keyframe of the road."""

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
    """Positive nose up, unlike ``Horizon.pitch``."""
    roll: float = 0.0
    """Positive right side down."""
    nod: float = 0.0
    """The pitch without the part of a turn that a camera with a roll sees as one."""
    passing: float = 0.0
    """Sum of the ratios of translation to distance of the near blocks, negative in reverse."""
    agreed: bool = False
    """Whether the blocks agree on the motion of the newest pair..."""
    agreement: float = 0.0
    """...and the share of those that do, 0 if that is one of a turn."""
    distance: float = 0.0
    """Sum of the distances of the pairs, and its variance."""
    variance: float = 0.0
    expired: bool = False
    """Whether the newest frame becomes the keyframe."""

    def add_rotation(
        self, yaw: float, pitch: float, roll: float, *, nod: float, interval: float,
        near: float | None, agreement: float = 0.0,
    ) -> None:
        """Add the rotation of a pair, and its ratio of translation to distance, if it has one."""
        self.agreed, self.agreement = near is not None, agreement
        self.passing += near or 0.0
        self.yaw += yaw
        self.pitch += pitch
        self.roll += roll
        self.nod += nod
        self.age += interval

    @property
    def pitch_deviation(self) -> float:
        """Return the standard deviation of the pitch in radians."""
        return TUNING.block_pitch_deviation if self.agreed else TUNING.unmeasured_pitch_deviation

    @property
    def moves(self) -> bool:
        """Return whether the vehicle may move, by the blocks."""
        return not self.agreed or abs(self.passing) > TUNING.passing

    @property
    def drives(self) -> bool:
        """Return whether the road must have slid, by the blocks."""
        return not self.agreed or abs(self.passing) > TUNING.driving

    @property
    def passes(self) -> bool:
        """Return whether the blocks agree that the world passes by."""
        return self.agreed and self.drives

    @property
    def creeps(self) -> bool:
        """Return whether the blocks agree that the world moves, but no close traffic."""
        return self.agreed and TUNING.passing < abs(self.passing) < TUNING.creeping

    @property
    def recedes(self) -> bool:
        """Return whether the blocks agree that the world recedes, as in reverse."""
        return self.passes and self.passing < 0.0

    @property
    def min_slide(self) -> float:
        """Return the least slide of the road in camera heights, by the blocks, with its sign."""
        return TUNING.min_block_distance * self.passing if self.passes else 0.0

    @property
    def turns(self) -> bool:
        """Return whether the vehicle turns: it drives, or turns on the spot."""
        return abs(self.yaw) > TUNING.driving_yaw_rate * self.age

    def is_far(self, distance: float, interval: float) -> bool:
        """Return whether a frame ``interval`` seconds later would be too far from the keyframe."""
        further = 1.0 + interval / self.age
        return (
            further * abs(distance) > TUNING.baseline or self.age >= TUNING.max_keyframe_age
            or abs(self.yaw) > TUNING.max_rotation)

    def add(
        self, distance: float, variance: float, speeds: SpeedFilter, interval: float,
    ) -> tuple[float, float]:
        """
        Return the distance of the newest pair and its variance, from that since the keyframe.

        It is smoothed with the speed, except for the last pair before a new keyframe. So the sum
        of all is the distance between the keyframes.
        """
        before = self.distance
        if self.expired or not speeds.known:
            self.distance, self.variance = distance, variance
            return self.distance - before, variance
        predicted = before + speeds.speed * interval
        noise = (speeds.observed_deviation * interval) ** 2
        prior_variance = self.variance + noise
        gain = prior_variance / (prior_variance + variance)
        self.distance = predicted + gain * (distance - predicted)
        self.variance = gain * variance
        return self.distance - before, noise

    def bridge(self, distance: float, variance: float) -> None:
        """Add the distance of a pair that is not measured, and its variance."""
        self.distance += distance
        self.variance += variance
