# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The part of a frame that is correlated, and its scale."""

from dataclasses import dataclass
import math
from typing import cast

import cv2
from phase_traj_ros.core.correlation.phase_correlation import Frame, Shift


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """
    A band of rows and columns of the frame, and how it is reduced.

    Raises
    ------
    ValueError
        A band is empty or extends beyond the frame, or the decimation is below 1.

    """

    rows: tuple[float, float] = (0.0, 1.0)
    """First and last row, as fractions of the height from the top of the upright picture."""
    columns: tuple[float, float] = (0.0, 1.0)
    """First and last column, as fractions of the width from the left of the upright picture."""
    decimation: int = 1
    """Size of the squares of pixels that are averaged into one."""
    rotate_180: bool = False
    """Whether the camera is mounted upside down."""

    def __post_init__(self) -> None:
        """Check the values."""
        for name, (begin, end) in (('rows', self.rows), ('columns', self.columns)):
            if not 0.0 <= begin < end <= 1.0:
                raise ValueError(
                    f'{name} from {begin} to {end}: give two fractions of the frame, the smaller'
                    ' one first')
        if self.decimation < 1:
            raise ValueError(f'decimation is {self.decimation}: give at least 1')

    def of(self, frame: Frame) -> Frame:
        """
        Return the part of ``frame`` to correlate, (h, w) of the same type.

        It is a view of the frame, not a copy, unless it is decimated.
        """
        if frame.ndim != 2:
            return frame  # the correlator raises the error
        first, last = _pixels(self._upright(self.rows), frame.shape[0], self.decimation)
        left, right = _pixels(self._upright(self.columns), frame.shape[1], self.decimation)
        band = frame[first:last, left:right]
        if self.decimation == 1:
            return band
        if 0 in band.shape:
            return band
        size = (band.shape[1] // self.decimation, band.shape[0] // self.decimation)
        return cast('Frame', cv2.resize(band, size, interpolation=cv2.INTER_AREA))

    def full_shift(self, shift: Shift) -> Shift:
        """Convert a shift measured in this view to pixels of the full, upright frame."""
        scale = -self.decimation if self.rotate_180 else self.decimation
        return Shift(shift.dx * scale, shift.dy * scale, shift.response)

    def _upright(self, band: tuple[float, float]) -> tuple[float, float]:
        return (1.0 - band[1], 1.0 - band[0]) if self.rotate_180 else band


def _pixels(band: tuple[float, float], length: int, multiple: int) -> tuple[int, int]:
    """Return the first and last pixel of a band; their distance is a multiple of ``multiple``."""
    first, last = math.floor(band[0] * length + 0.5), math.floor(band[1] * length + 0.5)
    return first, first + (last - first) // multiple * multiple
