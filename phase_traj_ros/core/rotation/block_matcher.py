# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures the motion since a keyframe: finds its blocks in a frame, and fits the motion."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.rotation.camera_motion import CameraMotion, MotionFit, quantile
from phase_traj_ros.core.rotation.focus_of_expansion import FocusOfExpansion
from phase_traj_ros.core.rotation.keyframe import Keyframe
from phase_traj_ros.core.rotation.local_shifts import BlockGrid, BlockShifts
from phase_traj_ros.core.rotation.tuning import TUNING
from phase_traj_ros.errors import FrameError


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
        self, key: Keyframe, current: NDArray[np.uint8], expected: tuple[float, float],
        travel: FocusOfExpansion,
    ) -> Match | None:
        """
        Return the motion from a keyframe to a picture; None if it is not determined.

        ``expected`` is the shift (dx, dy) since the previous frame, in pixels, around which the
        blocks are searched, and ``travel`` the predicted direction of travel.
        """
        blocks = self.grid.measure(key.picture, current, expected=key.moved + np.array(expected))
        motion = self._fit(
            blocks.dx / self._px_per_rad, blocks.dy / self._px_per_rad, blocks.weight, travel,
            aside=key.picture.aside / self._px_per_rad, down=key.picture.down / self._px_per_rad,
            precision=blocks.precision)
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
