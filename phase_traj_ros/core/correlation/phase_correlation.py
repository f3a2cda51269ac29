# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Phase correlation: the shift of the image between two frames.

The method is that of Kuglin and Hines (1975). Equations are numbered as in A. Abdulkadhem,
"Trajectory Approximation of Video Based on Phase Correlation for Forward Facing Camera".
"""

from dataclasses import dataclass
import math
from typing import cast

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray
from phase_traj_ros.core.correlation.mask import check_size, mask_weights
from phase_traj_ros.core.correlation.spectrum import (
    aligned_zeros,
    CrossPhase,
    padded_shape,
    ROUNDING,
)
from phase_traj_ros.core.correlation.transforms import find_transform
from phase_traj_ros.core.correlation.windows import window_2d
from phase_traj_ros.errors import FrameError

Frame = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32]

MIN_SIDE = 8
"""Number of rows and columns that a frame has at least."""
_DTYPES = (np.uint8, np.uint16, np.float32)
# Half the side of the square over which forward motion spreads a peak, as a share of the
# frame's size (the root of its area): 4 pixels for a frame of 376 x 1241.
_REACH = 1 / 170


@dataclass(frozen=True, slots=True)
class Shift:
    """
    Displacement of the image content from the previous frame to the current one.

    dx
        Pixels, positive to the right: the camera turned left.
    dy
        Pixels, positive downwards.
    response
        Height of the correlation peak, 0 to 1: 1 for identical frames, 0 if there is nothing to
        correlate (a constant frame).
    """

    dx: float
    dy: float
    response: float


class PhaseCorrelator:
    """
    Measures the shift between each frame and the previous one.

    It keeps the spectrum of the previous frame, so each frame costs one forward and one
    inverse transform. Nothing of a frame's size is allocated after the first frame.
    """

    def __init__(self, *, mask: ArrayLike | None = None) -> None:
        """
        Make a correlator; it takes the size of the frames from the first one.

        ``mask`` is the weight of each of their pixels, (H, W), 0 to 1 or 0 to 255.

        Raises
        ------
        ValueError
            The mask is not (H, W), holds a negative value, NaN or infinity, or is empty.

        """
        self._transforms = find_transform()
        self._mask = None if mask is None else mask_weights(mask)
        self._shape = (0, 0)
        self._primed = False
        # All steps of a pair are done in place: this array holds the tapered frame, its spectrum,
        # the cross-phase spectrum and the map, in this order.
        self._map: NDArray[np.float32] = np.empty((0, 0), np.float32)
        self._energy = 0.0
        # Of the last pair: the height of the peak of identical frames as a share of the map's
        # unit (0 if there is no map), that unit, and the position of the peak.
        self._highest = 0.0
        self._unit = 1.0
        self._peak = (0, 0)

    def reset(self) -> None:
        """Forget the previous frame: the next one becomes the first of a pair."""
        self._primed = False

    def update(self, frame: Frame) -> Shift | None:
        """
        Return the shift from the previous frame to ``frame``, or None if there is no pair.

        There is no pair at the first frame, after a reset, and when the size of the frames
        changes. The frame given is then the first of the next pair. It is (H, W) uint8, uint16 or
        float32, at least 8 x 8, of any scale and offset.

        Raises
        ------
        FrameError
            The shape or type of the frame is not supported, its size is not that of the mask, or
            it holds NaN or infinity. The state of the correlator is unchanged.

        """
        check_form(frame)
        mean, deviation = mean_and_deviation(frame)
        if self._mask is not None:
            check_size(frame, self._mask)
        if frame.shape != self._shape:
            self._allocate(frame.shape)
        energy = self._transform(frame, mean, deviation)
        primed, self._primed = self._primed, True
        self._highest = math.sqrt(self._energy * energy) if primed else 0.0
        self._energy = energy
        return self._correlate() if primed else None

    def correlation_map(self) -> NDArray[np.float32]:
        """
        Return a copy of the last pair's correlation map r (eq. 2, the paper's figure 2).

        (M, N) float32, the padded size. The zero shift is at [M // 2, N // 2], and identical
        frames peak at 1. Valid after ``update`` has returned a shift.
        """
        centred = np.fft.fftshift(self._map)
        return cast('NDArray[np.float32]', centred / np.float32(self._unit))

    def significance(self, shift: Shift) -> float:
        """
        Return the sum of the last pair's map around ``shift``, in standard deviations of noise.

        The sum is taken over a small square about the shift, and divided by the standard
        deviation of the same sum for two unrelated frames: their phases are random, and the map
        is noise of known standard deviation, because the energy of a whitened spectrum is known.
        Unlike the height of the peak, the sum includes what forward motion spreads around it.
        Valid for shifts measured on the last pair; 0 if nothing was correlated.
        """
        if self._highest == 0.0:
            return 0.0
        reach = max(round(_REACH * math.sqrt(self._window.size)), 1)
        near = self._near((round(shift.dy), round(shift.dx)), reach)
        values = self._map[near]
        typical = self._unit * math.sqrt(self._highest * values.size / self._map.size)
        return float(values.sum(dtype=np.float64)) / typical

    def second_peak(self, *, apart: int) -> Shift:
        """
        Return the highest point of the last pair's map that is not near the peak.

        Points within ``apart`` pixels of the peak along both axes are near it; the map is cyclic.
        The position is refined like that of the peak. A response of 0 means that the map holds
        no positive value there, or that there is no map. Valid after ``update`` has returned a
        shift. Leaves the state unchanged and allocates nothing of a frame's size.
        """
        if self._highest == 0.0:
            return Shift(0.0, 0.0, 0.0)
        near = self._near(self._peak, apart)
        saved = self._map[near]
        self._map[near] = -np.inf
        row, column = divmod(int(self._map.argmax()), self._map.shape[1])
        self._map[near] = saved
        if self._map[row, column] <= 0.0:
            return Shift(0.0, 0.0, 0.0)
        return self._shift_at(row, column)

    def _near(self, place: tuple[int, int], reach: int) -> tuple[NDArray[np.intp], ...]:
        """Return the index of the square about ``place`` (row, column) in the cyclic map."""
        reaches = (min(reach, side // 2 - 1) for side in self._map.shape)
        return np.ix_(*(
            np.arange(middle - most, middle + most + 1) % side
            for middle, most, side in zip(place, reaches, self._map.shape)))

    def _allocate(self, shape: tuple[int, int]) -> None:
        padded = padded_shape(shape)
        self._shape = shape
        self._window = window_2d(shape)
        if self._mask is not None:
            self._window *= self._mask
            self._window_sum = float(self._window.sum(dtype=np.float64))
        self._window_rms = math.sqrt(float(np.mean(np.square(self._window))))
        self._map = aligned_zeros(padded)
        self._cross = CrossPhase(padded)
        self._primed = False

    def _transform(self, frame: Frame, mean: float, deviation: float) -> float:
        """Replace the map by the cross-phase spectrum of ``frame``; return its energy."""
        if deviation == 0.0:
            return self._nothing()
        height, width = frame.shape
        spectrum = self._map
        tapered = spectrum[:height, :width]
        spectrum[height:] = 0.0
        spectrum[:height, width:] = 0.0
        # Subtracting the mean keeps the spectrum of the window out of a frame that is almost
        # constant: it never moves, and would be measured as a shift of zero.
        cv2.subtract(  # type: ignore[call-overload]
            frame, (mean, 0.0, 0.0, 0.0), dst=tapered, dtype=cv2.CV_32F)
        cv2.multiply(tapered, self._window, dst=tapered)
        spectrum_rms = deviation * self._window_rms * math.sqrt(frame.size)
        if self._mask is not None:
            # The mean of the unmasked part differs, and the mask may leave nothing else.
            rest = cv2.sumElems(tapered)[0] / self._window_sum
            cv2.scaleAdd(self._window, -rest, tapered, dst=tapered)
            if cv2.norm(tapered) <= ROUNDING * spectrum_rms:
                return self._nothing()
        self._transforms.forward(spectrum, height)
        # Eq. 1 conjugates the current spectrum and so peaks at minus the displacement. Here the
        # previous one is conjugated, so the peak is at the displacement itself.
        return self._cross(spectrum, spectrum_rms)

    def _nothing(self) -> float:
        """Take a frame without content; return its energy."""
        self._cross.clear()
        return 0.0

    def _correlate(self) -> Shift:
        """Turn the cross-phase spectrum into the map; find its peak (eqs. 2 and 3)."""
        if self._highest == 0.0:
            self._map.fill(0.0)
            return Shift(0.0, 0.0, 0.0)
        self._unit = self._transforms.inverse(self._map)
        self._peak = row, column = divmod(int(self._map.argmax()), self._map.shape[1])
        return self._shift_at(row, column)

    def _shift_at(self, row: int, column: int) -> Shift:
        return Shift(
            dx=_refined(self._map[row], column),
            dy=_refined(self._map[:, column], row),
            response=min(float(self._map[row, column]) / (self._unit * self._highest), 1.0),
        )


def _refined(line: NDArray[np.float32], peak: int) -> float:
    """
    Return the position of the peak along a cyclic line through it, in pixels.

    A shift by whole pixels and a fraction d gives a peak of the form sin(pi x) / (pi x) about
    the true position (the Dirichlet kernel; cf. Foroosh, Zerubia, Berthod, "Extension of phase
    correlation to subpixel registration", 2002). For this form, the difference of the two
    neighbours divided by the peak is q = 2 d / (1 - d**2), which is solved for d. The difference
    cancels whatever surrounds the peak evenly, such as the broad foot caused by forward motion.
    """
    length = len(line)
    centre = float(line[peak])
    right, left = float(line[(peak + 1) % length]), float(line[peak - 1])
    ratio = (right - left) / centre if centre > 0.0 else 0.0
    fraction = ratio / (1.0 + math.sqrt(1.0 + ratio * ratio))
    position = peak if peak < length - peak else peak - length
    return position + min(max(fraction, -0.5), 0.5)


def check_form(frame: Frame) -> None:
    """
    Check that a frame has a shape and a type that can be correlated.

    Raises
    ------
    FrameError
        It is not (H, W), its type is not uint8, uint16 or float32, or it is smaller than 8x8.

    """
    if frame.ndim != 2:
        raise FrameError(f'frame has shape {frame.shape}: give a greyscale frame of shape (H, W)')
    if frame.dtype not in _DTYPES:
        raise FrameError(f'frame is {frame.dtype}: give uint8, uint16 or float32')
    if min(frame.shape) < MIN_SIDE:
        height, width = frame.shape
        raise FrameError(f'frame is {width}x{height} pixels: give at least {MIN_SIDE}x{MIN_SIDE}')


def mean_and_deviation(frame: Frame) -> tuple[float, float]:
    """
    Return the mean and the standard deviation of a frame.

    Raises
    ------
    FrameError
        It holds NaN or infinity.

    """
    means, deviations = cv2.meanStdDev(frame)
    mean, deviation = float(means[0, 0]), float(deviations[0, 0])
    if not math.isfinite(mean + deviation):
        raise FrameError('frame holds NaN or infinity, or values too large for float32')
    return mean, deviation
