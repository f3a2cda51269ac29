# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Real 2-D spectra in OpenCV's packed layout, and the operations phase correlation needs on them.

``cv2.dft`` keeps the spectrum of a real (M, N) array in an array of the same size. With both
sides even, columns 1 to N-2 hold pairs (real, imaginary) of the column frequencies 1 to N/2-1;
column 0 and column N-1 hold the frequencies 0 and N/2, which are spectra of real columns
themselves: a real number in the first and the last row, pairs down the column between them.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

_FACTORS = (2, 3, 5)
_LEAST_PADDING = 4
# Rows whitened at a time: few enough to stay in a core's own cache, enough to hide call costs.
_BLOCK_ROWS = 64


def _is_smooth(number: int) -> bool:
    for factor in _FACTORS:
        while number % factor == 0:
            number //= factor
    return number == 1


def padded_side(length: int) -> int:
    """
    Return the transform's length for a side of ``length`` pixels.

    The smallest even product of 2, 3 and 5 that is ``length`` itself or at least 4 more: with
    a padding of a pixel or two, the content that a cyclic shift wraps around would correlate
    right beside the peak and bend it. A pure function of the length, so that every run of every
    program gives the same shifts.
    """
    side = length
    while side % 2 or not _is_smooth(side) or 0 < side - length < _LEAST_PADDING:
        side += 1
    return side


def padded_shape(shape: tuple[int, int]) -> tuple[int, int]:
    """Return the transform's size (M, N) for a frame of ``shape`` (H, W)."""
    return padded_side(shape[0]), padded_side(shape[1])


class Whitener:
    """Scales every bin of a packed spectrum to magnitude 1, in place, without allocating."""

    def __init__(self, shape: tuple[int, int]) -> None:
        """Make the scratch space for spectra of ``shape`` (M, N), both even."""
        self._size = shape[0] * shape[1]
        self._magnitude = np.empty((min(_BLOCK_ROWS, shape[0]), shape[1] // 2 - 1), np.float32)
        self._edges = np.empty((2, shape[0]), np.float32)

    def __call__(self, spectrum: NDArray[np.float32], floor: float) -> float:
        """
        Whiten ``spectrum`` (M, N) in place.

        Bins weaker than ``floor`` hold rounding noise rather than picture: they are divided by
        the floor and so stay weak. Return the mean squared magnitude after whitening: 1 unless
        bins lay below the floor.
        """
        weakest = np.inf
        rows_at_once = len(self._magnitude)
        for first in range(0, len(spectrum), rows_at_once):
            bins = spectrum[first:first + rows_at_once, 1:-1].view(np.complex64)
            magnitude = self._magnitude[:len(bins)]
            np.abs(bins, out=magnitude)
            weakest = min(weakest, float(magnitude.min()))
            np.maximum(magnitude, floor, out=magnitude)
            np.reciprocal(magnitude, out=magnitude)
            np.multiply(bins, magnitude, out=bins)
        weakest = min(weakest, self._whiten_edges(spectrum, floor))
        return 1.0 if weakest >= floor else self._mean_square(spectrum)

    def _whiten_edges(self, spectrum: NDArray[np.float32], floor: float) -> float:
        edges = self._edges
        edges[0] = spectrum[:, 0]
        edges[1] = spectrum[:, -1]
        weakest = np.inf
        for bins in (edges[:, 1:-1].view(np.complex64), edges[:, ::edges.shape[1] - 1]):
            magnitude = np.abs(bins)
            weakest = min(weakest, float(magnitude.min()))
            np.divide(bins, np.maximum(magnitude, np.float32(floor)), out=bins)
        spectrum[:, 0] = edges[0]
        spectrum[:, -1] = edges[1]
        return weakest

    def _mean_square(self, spectrum: NDArray[np.float32]) -> float:
        # A packed pair stands for two conjugate bins, so it counts twice; the edges' four real
        # numbers stand for themselves.
        twice = cv2.norm(spectrum, cv2.NORM_L2SQR) * 2
        corners = spectrum[::len(spectrum) - 1, ::spectrum.shape[1] - 1]
        return (twice - float(np.square(corners, dtype=np.float64).sum())) / self._size
