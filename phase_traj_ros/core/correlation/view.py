# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How a frame is turned and reduced before it is correlated."""

from dataclasses import dataclass
from typing import cast

import cv2
from phase_traj_ros.core.correlation.phase_correlation import Frame, Shift


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """
    How a frame is turned and reduced before it is correlated.

    Raises
    ------
    ValueError
        The decimation is below 1.

    """

    decimation: int = 1
    """Size of the squares of pixels that are averaged into one."""
    rotate_180: bool = False
    """Whether the camera is mounted upside down."""

    def __post_init__(self) -> None:
        """Check the values."""
        if self.decimation < 1:
            raise ValueError(f'decimation is {self.decimation}: give at least 1')

    def of(self, frame: Frame) -> Frame:
        """
        Return ``frame`` as it is correlated, (h, w) of the same type.

        It is the frame itself, not a copy, unless it is decimated.
        """
        if self.decimation == 1 or frame.ndim != 2:
            return frame  # the correlator raises the error
        size = (frame.shape[1] // self.decimation, frame.shape[0] // self.decimation)
        whole = frame[:size[1] * self.decimation, :size[0] * self.decimation]
        if 0 in size:
            return whole[:0, :0]
        return cast('Frame', cv2.resize(whole, size, interpolation=cv2.INTER_AREA))

    def full_shift(self, shift: Shift) -> Shift:
        """Convert a shift measured in this view to pixels of the full, upright frame."""
        scale = -self.decimation if self.rotate_180 else self.decimation
        return Shift(shift.dx * scale, shift.dy * scale, shift.response)
