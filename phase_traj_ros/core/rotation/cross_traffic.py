# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Recognises traffic that crosses close in front of a standing camera.

A lorry at a junction may cover most of the image, and its blocks agree on one motion, like those
of a turn. But a vehicle that turns moves forward, too, so objects pass by, and no block rests.
"""

from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.tuning import TUNING


class CrossTraffic:
    """Whether the blocks may move with traffic while the camera stands."""

    def __init__(self) -> None:
        """Start without traffic."""
        self.may_cross = False
        """Whether the newest motion may be that of traffic."""
        # Whether it covers most of the image, and whether the newest motion contradicts it.
        self._covers = self._doubted = False

    def update(self, motion: CameraMotion, resting: float, seconds: float) -> None:
        """Add the motion of the newest frame; see ``explains``."""
        explained = self.explains(motion, resting, seconds)
        # One contradiction may be a wrong measurement.
        self.may_cross = explained or (self._covers and not self._doubted)
        self._covers = self.may_cross and resting < TUNING.free_share
        self._doubted = not explained

    def explains(self, motion: CameraMotion, resting: float, seconds: float) -> bool:
        """
        Return whether a motion within ``seconds`` may be that of traffic.

        ``resting`` is the share of the blocks that do not move, 0 to 1.
        """
        if abs(motion.yaw) <= TUNING.straight_yaw_rate * seconds:
            return self._covers and motion.passing <= TUNING.min_passing
        rests = resting >= TUNING.resting_share
        turns_only = motion.passing < TUNING.turning_passing * abs(motion.yaw)
        # It begins with both. Later, the traffic may cover the whole image, or pass at an angle.
        return (rests or turns_only) if self._covers else (rests and turns_only)
