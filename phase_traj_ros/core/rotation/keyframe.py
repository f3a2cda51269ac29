# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The frame with which the next ones are compared.

Between two frames, a slow vehicle moves the image by less than the errors of the blocks, and these
add up. So all frames are measured from a keyframe, which is replaced when the image has moved far
enough, after half a second at the latest (Leutenegger et al., "Keyframe-based visual-inertial
odometry", 2015).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.rotation.camera_motion import CameraMotion, quantile
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion, Mounting
from phase_traj_ros.core.rotation.local_shifts import BlockPicture, BlockShifts
from phase_traj_ros.core.rotation.tuning import TUNING


class Keyframe:
    """A frame, and the motion of the blocks and of the camera since."""

    def __init__(self, picture: BlockPicture, travel: FocusOfExpansion) -> None:
        """Begin with a picture and the direction of travel."""
        self.picture = picture
        self.moved: NDArray[np.float64] = np.zeros((len(picture.texture), 2))
        """Displacement of each block up to the newest frame, in pixels."""
        self.age = 0.0
        """Seconds since."""
        self.travel = self._initial_travel = travel
        """Direction of travel at the newest frame."""
        self._rotation = (0.0, 0.0, 0.0)

    @property
    def yaw(self) -> float:
        """Return the yaw since, in radians, up to the newest frame that was compared with it."""
        return self._rotation[0]

    def predict_travel(self, yaw_rate: float, mounting: Mounting) -> FocusOfExpansion:
        """
        Return the prior direction of travel for a comparison with this frame.

        ``yaw_rate`` is in radians per second. The prior excludes the evidence of earlier
        comparisons with this frame.
        """
        return self._initial_travel.predict(self.age, yaw_rate, mounting)

    def add(self, motion: CameraMotion, blocks: BlockShifts) -> CameraMotion:
        """Add the motion since this frame; return it with the rotation of the newest pair."""
        last, seen = self.moved.copy(), blocks.weight > 0.0
        for column, moved in enumerate((blocks.dx, blocks.dy)):
            self.moved[:, column] = np.where(seen, moved, quantile(moved[seen], 0.5))
        # By the displacement of the blocks, not by time: the vehicle may have stopped meanwhile.
        far, newest = (quantile(np.hypot(*each.T), 0.5) for each in (
            self.moved, self.moved - last))
        share = newest / far if far > newest else 1.0
        before, self._rotation = self._rotation, (motion.yaw, motion.pitch, motion.roll)
        yaw, pitch, roll = (after - last for after, last in zip(self._rotation, before))
        return replace(motion, yaw=yaw, pitch=pitch, roll=roll, age=self.age,
                       near=share * motion.near)

    def is_near(self, passing: float, yaw_rate: float, later: float) -> bool:
        """
        Return whether a frame ``later`` seconds after the newest one is near enough to this one.

        ``passing`` is the median ratio of translation to distance of the blocks, per second.
        """
        return (passing * (self.age + later) <= TUNING.baseline
                and abs(self.yaw + yaw_rate * later) <= TUNING.max_rotation)

    def has_expired(self, motion: CameraMotion, interval: float) -> bool:
        """
        Return whether the next frame would be too far from this one, by the motion since.

        It is expected after ``interval`` seconds, at the same speed. So a fast vehicle is measured
        from frame to frame.
        """
        further = 1.0 + interval / self.age
        return (further * motion.passing > TUNING.baseline
                or further * abs(motion.yaw) > TUNING.max_rotation
                or self.age >= TUNING.max_keyframe_age_s)
