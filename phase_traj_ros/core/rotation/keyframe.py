# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The frame with which the next ones are compared.

Between two frames, a slow vehicle moves the image by less than the errors of the blocks, and these
add up along the way. A keyframe is therefore kept until the image has moved far enough since
(Leutenegger et al., "Keyframe-based visual-inertial odometry", 2015): at once on a fast vehicle,
after up to half a second on a slow one. All frames in between are measured from the keyframe, so
their errors do not add up.
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
        self.travel = self._begun = travel
        """Direction of travel at the newest frame."""
        self._rotation = (0.0, 0.0, 0.0)

    @property
    def turned(self) -> float:
        """Return the yaw since, in radians, up to the newest frame that was compared with it."""
        return self._rotation[0]

    def foreseen(self, yaw_rate: float, mounting: Mounting) -> FocusOfExpansion:
        """
        Return the direction of travel that is foreseen for the comparison with this frame.

        ``yaw_rate`` is in radians per second. The result does not contain the evidence of the
        comparisons with this frame so far.
        """
        return self._begun.after(
            self.age, yaw_rate, mounted=mounting.angle, unsure=mounting.deviation)

    def pair(self, motion: CameraMotion, blocks: BlockShifts) -> CameraMotion:
        """Add the motion since this frame; return it with the rotation of the newest pair."""
        last, seen = self.moved.copy(), blocks.weight > 0.0
        for column, moved in enumerate((blocks.dx, blocks.dy)):
            self.moved[:, column] = np.where(seen, moved, quantile(moved[seen], 0.5))
        # By how far the blocks moved, not by its time: the vehicle may have stopped meanwhile.
        far, newest = (quantile(np.hypot(*each.T), 0.5) for each in (
            self.moved, self.moved - last))
        share = newest / far if far > newest else 1.0
        before, self._rotation = self._rotation, (motion.yaw, motion.pitch, motion.roll)
        yaw, pitch, roll = (after - last for after, last in zip(self._rotation, before))
        return replace(motion, yaw=yaw, pitch=pitch, roll=roll, age=self.age,
                       near=share * motion.near)

    def reaches(self, passing: float, yaw_rate: float, later: float) -> bool:
        """
        Return whether a frame ``later`` seconds after the newest one is near enough to this one.

        ``passing`` is the median ratio of translation to distance of the blocks, per second.
        """
        return (passing * (self.age + later) <= TUNING.baseline
                and abs(self.turned + yaw_rate * later) <= TUNING.most_turned)

    def is_over(self, motion: CameraMotion, interval: float) -> bool:
        """
        Return whether the next frame would be too far from this one, by the motion since.

        It is foreseen to come after ``interval`` seconds, at the same speed. A vehicle that moves
        far within one pair is therefore measured from frame to frame.
        """
        further = 1.0 + interval / self.age
        return (further * motion.passing > TUNING.baseline
                or further * abs(motion.yaw) > TUNING.most_turned
                or self.age >= TUNING.longest_s)
