# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How a frame is reduced before it is compared, and how its camera is mounted."""

from dataclasses import dataclass
import math
from typing import Any, cast, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.phase_correlation import Frame, Shift


def reduced(frame: Frame, down: int, across: int) -> Frame:
    """
    Return the means of blocks of a frame, (H // down, W // across), of the same type.

    Pixels at the end that do not fill a block are left out. Factors of two are averaged first,
    which for 8 bits rounds once more: OpenCV is eight times as fast for 2x2 pixels as for 4x4.
    With factors of 1, it is the frame itself.
    """
    height, width = frame.shape[0] // down, frame.shape[1] // across
    frame = frame[:height * down, :width * across]
    while down > 1 or across > 1:
        halves = down % 2 == 0 and across % 2 == 0
        down, across = (down // 2, across // 2) if halves else (1, 1)
        frame = cv2.resize(  # type: ignore[assignment]
            frame, (width * across, height * down), interpolation=cv2.INTER_AREA)
    return frame


def halvings(shape: tuple[int, int], *, pixels: int, least: int) -> int:
    """
    Return how often to halve the sides of a frame of ``shape`` (H, W).

    It then has about so many ``pixels``, but no side has fewer than ``least``.
    """
    wanted = round(math.log2(max(shape[0] * shape[1] / pixels, 1.0)) / 2)
    return min(wanted, int(math.log2(max(min(shape) / least, 1.0))))


_ImageT = TypeVar('_ImageT', bound=NDArray[Any])


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """
    How a frame is reduced before it is correlated, and how its camera is mounted.

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

    def upright(self, image: _ImageT) -> _ImageT:
        """Return a frame or a mask, (H, W), upright: a read-only copy if the camera is not."""
        if not self.rotate_180:
            return image
        turned = np.ascontiguousarray(np.flip(image))
        turned.flags.writeable = False
        return cast('_ImageT', turned)

    def of(self, frame: Frame) -> Frame:
        """Return ``frame``, (H, W), as it is correlated; see ``reduced``."""
        if min(frame.shape) < self.decimation:
            return frame[:0, :0]  # the correlator raises the error
        return reduced(frame, self.decimation, self.decimation)

    def full_shift(self, shift: Shift) -> Shift:
        """Convert a shift measured in this view to pixels of the full frame."""
        return Shift(
            shift.dx * self.decimation, shift.dy * self.decimation, shift.response)
