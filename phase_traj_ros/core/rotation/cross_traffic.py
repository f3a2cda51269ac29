# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Recognises traffic that crosses close in front of a standing camera.

A lorry at a junction may cover most of the image, and its blocks agree on one motion, like those
of a turn. But a vehicle that turns also moves forward, so nearby objects pass by, and no block
stays at rest. A camera that turns on the spot may see its own vehicle at rest, but all of the
scene begins to turn at once, while traffic first moves in a part of the image.
"""

from phase_traj_ros.core.rotation.camera_motion import CameraMotion
from phase_traj_ros.core.rotation.tuning import TUNING


class CrossTraffic:
    """Whether the blocks move with traffic while the camera stands."""

    def __init__(self, *, still: float) -> None:
        """Start without traffic; a camera that turns by less than ``still`` radians stands."""
        self._still = still
        self.crosses = False
        """Whether the newest motion is that of traffic."""
        # Whether a part of the image moved while the camera did not turn, whether traffic covers
        # most of it, and whether the newest motion contradicts that.
        self._enters = self._covers = self._doubted = False

    def update(self, motion: CameraMotion, resting: float, *, moving: float, stood: bool) -> None:
        """
        Add the motion since the keyframe; see ``explains``.

        ``moving`` is the share of the blocks that certainly move, and ``stood`` whether the
        vehicle did not drive before.
        """
        if abs(motion.yaw) < self._still:
            # When a camera begins to turn, all blocks move, but hardly yet.
            self.crosses, self._enters = False, stood and moving > TUNING.entering_share
            lasts = self._covers and motion.passing <= TUNING.min_passing
        else:
            explained = self.explains(motion, resting)
            # One contradiction may be a wrong measurement.
            lasts = self.crosses = explained or (self._covers and not self._doubted)
            self._enters &= explained or not self._doubted
            self._doubted = not explained
        self._covers = lasts and resting < TUNING.free_share

    def explains(self, motion: CameraMotion, resting: float) -> bool:
        """
        Return whether traffic explains a motion that looks like a turn.

        ``resting`` is the share of the blocks that do not move, 0 to 1.
        """
        rests = resting >= TUNING.resting_share
        turns_only = motion.passing < TUNING.turning_passing * abs(motion.yaw)
        # Both are required at first. Later, the traffic may cover all, or pass at an angle.
        return (rests or turns_only) if self._covers else (self._enters and rests and turns_only)
