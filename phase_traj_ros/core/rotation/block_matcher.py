# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Measures the motion since a keyframe: finds its blocks in a frame, and fits the motion.

Between two frames, a slow vehicle moves the image by less than the errors of the blocks, and these
add up. So all frames are measured from a keyframe, which is replaced when the image has moved far
enough, after half a second at the latest (Leutenegger et al., "Keyframe-based visual-inertial
odometry", 2015).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.rotation.camera_motion import CameraMotion, MotionFit, quantile
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion, Mounting
from phase_traj_ros.core.rotation.local_shifts import BlockGrid, BlockPicture, BlockShifts
from phase_traj_ros.core.rotation.tuning import TUNING
from phase_traj_ros.errors import FrameError


class Keyframe:
    """A frame with which the next ones are compared, and the motion since."""

    def __init__(self, picture: BlockPicture, travel: FocusOfExpansion) -> None:
        """Begin with a picture and the direction of travel."""
        self.picture = picture
        self.moved: NDArray[np.float64] = np.zeros((len(picture.texture), 2))
        """Displacement of each block up to the newest frame, in pixels."""
        self.age = 0.0
        """Seconds since."""
        self.agreement = 0.0
        """Largest share of the blocks that agreed on a motion since, 0 to 1."""
        self.travel = self._initial_travel = travel
        """Direction of travel, half-way to the newest frame."""
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

    def add(self, motion: CameraMotion, blocks: BlockShifts, *, roll: float) -> CameraMotion:
        """
        Add the motion since this frame of a camera with this roll, in radians, right side down.

        Return it with the rotation of the newest pair, and the direction of travel in the newest
        frame.
        """
        self.agreement = max(self.agreement, motion.agreement)
        last, seen = self.moved.copy(), blocks.weight > 0.0
        for column, moved in enumerate((blocks.dx, blocks.dy)):
            self.moved[:, column] = np.where(seen, moved, quantile(moved[seen], 0.5))
        # By the displacement of the blocks, not by time: the vehicle may have stopped meanwhile.
        far, newest = (quantile(np.hypot(*each.T), 0.5) for each in (
            self.moved, self.moved - last))
        share = newest / far if far > newest else 1.0
        before, self._rotation = self._rotation, (motion.yaw, motion.pitch, motion.roll)
        yaw, pitch, rolled = (after - last for after, last in zip(self._rotation, before))
        # The slope is measured half-way between the frames. The course is that of the chord.
        travel = replace(motion.travel, slope=motion.travel.slope + motion.nod(roll) / 2)
        return replace(motion, yaw=yaw, pitch=pitch, roll=rolled, travel=travel, age=self.age,
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


@dataclass(frozen=True, slots=True)
class Match:
    """The motion since a keyframe, and the displacements of the blocks that it follows from."""

    key: Keyframe
    motion: CameraMotion
    blocks: BlockShifts


class BlockMatcher:
    """Compares pictures of the cylinder with keyframes, by the blocks of a fixed grid."""

    def __init__(self, projection: CylinderProjection, counts: NDArray[np.bool_]) -> None:
        """
        Make a matcher, with blocks whose centre is True in ``counts``, (H, W) on the cylinder.

        Raises
        ------
        FrameError
            Too few blocks are left.

        """
        self._px_per_rad = projection.px_per_rad
        self.grid = BlockGrid(counts)
        """The grid, which knows the blocks that are fixed to the camera or masked."""
        if len(self.grid.centres) < TUNING.min_blocks:
            raise FrameError('the mask covers too much of the frames to measure yaw: give one'
                             ' that covers less')
        columns, rows = self.grid.centres.T
        azimuths = np.interp(columns, np.arange(projection.shape[1]), projection.azimuths)
        slopes = np.interp(rows, np.arange(projection.shape[0]), projection.slopes)
        self._fit = MotionFit(
            azimuths, slopes, deviation=TUNING.block_deviation_px / self._px_per_rad)
        self._on_road = slopes > TUNING.road_slope

    def keyframe(self, picture: NDArray[np.uint8], travel: FocusOfExpansion) -> Keyframe:
        """Return a picture, (H, W), as a keyframe with this direction of travel."""
        return Keyframe(self.grid.extract(picture), travel)

    def match(
        self, key: Keyframe, current: NDArray[np.uint8], travel: FocusOfExpansion,
        expected: tuple[float, float], *, reverses: bool = True,
    ) -> Match | None:
        """
        Return the motion from a keyframe to a picture; None if it is not determined.

        ``travel`` is the predicted direction of travel, ``expected`` the shift (dx, dy) since the
        previous frame, in pixels, around which the blocks are searched, and ``reverses`` whether
        the vehicle may reverse.
        """
        blocks = self.grid.measure(key.picture, current, expected=key.moved + np.array(expected))
        motion = self._fit(
            blocks.dx / self._px_per_rad, blocks.dy / self._px_per_rad, blocks.weight, travel,
            aside=key.picture.aside / self._px_per_rad, down=key.picture.down / self._px_per_rad,
            precision=blocks.precision, reverses=reverses)
        return None if motion is None else Match(key, motion, blocks)

    def learn(self, match: Match) -> None:
        """Learn from a match which blocks are fixed to the camera."""
        blocks = match.blocks
        if abs(match.motion.yaw) * self._px_per_rad > TUNING.min_image_shift_px:
            must_move = np.ones_like(self._on_road)
        else:
            # Straight ahead, distant parts of the scene do not move; the road is near, and does.
            drives = quantile(np.hypot(blocks.dx, blocks.dy), 0.5) > TUNING.min_road_shift_px
            must_move = self._on_road & drives
        self.grid.learn(blocks, must_move)
