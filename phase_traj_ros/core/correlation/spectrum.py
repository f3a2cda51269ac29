# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Real 2-D spectra in OpenCV's packed layout, and the cross-phase spectrum of two of them.

``cv2.dft`` stores the spectrum of a real (M, N) array in an array of the same size. With both
sides even, columns 1 to N-2 hold pairs (real, imaginary) of the column frequencies 1 to N/2-1.
Column 0 and column N-1 hold the frequencies 0 and N/2, which are spectra of real columns: a real
number in the first and the last row, and pairs down the column between them.
"""

from itertools import count
import math

import cv2
import numpy as np
from numpy.typing import NDArray

ROUNDING = 1e-6
"""Rounding noise of a float32 transform, as a share of the spectrum's root mean square."""
# Keeps a spectrum without content 0.
_LEAST = float(np.finfo(np.float32).tiny)
_MULTIPLE = 8
_LEAST_PADDING = 4
_CRAMPED, _CROWDED = 256, 1024
# Bins whitened at a time: few enough to fit a core's own cache, enough to hide call overhead.
_BLOCK_BINS = 1 << 16
# Length of a cache line in bytes.
_LINE = 64


def padded_side(length: int) -> int:
    """
    Return the transform's length for a side of ``length`` pixels.

    A pure function of the length, so that every run on every machine gives the same shifts. It
    is the smallest side that

    - is a multiple of 8 and a product of 2, 3 and 5: both of OpenCV's implementations (its own,
      in Ubuntu, and Intel's, in the wheels) are fast for these;
    - is ``length`` itself or at least 4 more: with a padding of a pixel or two, the content that
      a cyclic shift wraps around would correlate right beside the peak and bias it;
    - is not a multiple of 1024, and is a multiple of 256 only if it is ``length`` itself: with
      strides of powers of two the columns evict each other from the cache.

    ``make bench`` compares the rule with its alternatives.
    """
    return next(side for side in count(length) if _suits(side, length))


def _suits(side: int, length: int) -> bool:
    if side % _MULTIPLE or side % _CROWDED == 0 or cv2.getOptimalDFTSize(side) != side:
        return False
    return side == length or (side - length >= _LEAST_PADDING and side % _CRAMPED != 0)


def padded_shape(shape: tuple[int, int]) -> tuple[int, int]:
    """Return the transform's size (M, N) for a frame of ``shape`` (H, W)."""
    return padded_side(shape[0]), padded_side(shape[1])


def aligned_zeros(shape: tuple[int, ...]) -> NDArray[np.float32]:
    """
    Return a float32 array of zeros of ``shape`` that starts at a multiple of 64 bytes.

    Vectorised loops process the elements before the first aligned address separately, and round
    them differently where they can fuse multiply and add. Arrays of numpy start at any address, so
    the same frames would give shifts that differ in the last digit from run to run.
    """
    size = math.prod(shape) * np.dtype(np.float32).itemsize
    raw = np.zeros(size + _LINE, np.uint8)
    first = -raw.ctypes.data % _LINE
    return raw[first:first + size].view(np.float32).reshape(shape)


class CrossPhase:
    """
    Turns the spectrum of each frame into its cross-phase spectrum with the previous one (eq. 1).

    Every bin of both is scaled to magnitude 1, and the previous one is conjugated. All steps run
    block by block, in place. Nothing of a spectrum's size is allocated after construction.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        """Allocate for spectra of ``shape`` (M, N), both even; there is no previous spectrum."""
        self._size = shape[0] * shape[1]
        columns = shape[1] // 2 - 1
        rows = min(max(_BLOCK_BINS // max(columns, 1) // _MULTIPLE, 1) * _MULTIPLE, shape[0])
        # One extra number each: OpenCV writes arrays of equal alignment past the cache, which
        # takes twice as long.
        scratch = aligned_zeros((5, rows * columns + 1))
        self._scratch = scratch[:, :-1].reshape(5, rows, columns)
        # The imaginary parts of the ends of the edges are not stored, and stay 0.
        self._edge_scratch = aligned_zeros((5, 2, shape[0] // 2 + 1))
        # Of the previous frame, at magnitude 1: real and imaginary part of the bins between the
        # edges, and of those of the two edges.
        self._parts = aligned_zeros((2, shape[0], columns))
        self._edges = aligned_zeros((2, 2, shape[0] // 2 + 1))

    def clear(self) -> None:
        """Take an empty spectrum."""
        self._parts.fill(0.0)
        self._edges.fill(0.0)

    def __call__(
        self, spectrum: NDArray[np.float32], rms: float, *, compare: bool = True,
        keep: bool = True,
    ) -> float:
        """
        Replace the next spectrum, (M, N), by its product with the conjugate of the previous one.

        Bins below ``ROUNDING`` times its root mean square, ``rms``, hold rounding noise: they are
        divided by this floor and so stay weak. Return the mean squared magnitude of the spectrum
        after the scaling: 1 unless bins were below the floor. Without ``keep``, the previous one
        stays for the next comparison; without ``compare``, the spectrum is only kept.
        """
        weakest, floor = np.inf, max(ROUNDING * rms, _LEAST)
        rows_at_once, columns = self._scratch.shape[1:]
        for first in range(0, len(spectrum), rows_at_once):
            bins = spectrum[first:first + rows_at_once, 1:-1].reshape(-1, columns, 2)
            scratch = self._scratch[:, :len(bins)]
            # OpenCV's and numpy's loops over real numbers are vectorised on every processor,
            # those over complex ones on few. Splitting costs less than the difference.
            cv2.split(bins, (scratch[0], scratch[1]))
            weakest = min(weakest, _cross(
                scratch, self._parts[:, first:first + rows_at_once], floor, compare, keep))
            if compare:
                cv2.merge((scratch[3], scratch[4]), dst=bins)
        packed, edges = spectrum[:, ::spectrum.shape[1] - 1].T, self._edge_scratch
        edges[0, :, 0], edges[0, :, 1:], edges[1, :, 1:-1] = (
            packed[:, 0], packed[:, 1::2], packed[:, 2::2])
        weakest = min(weakest, _cross(edges, self._edges, floor, compare, keep))
        if compare:
            packed[:, 0], packed[:, 1::2], packed[:, 2::2] = (
                edges[3, :, 0], edges[3, :, 1:], edges[4, :, 1:-1])
        return 1.0 if weakest >= floor else self._mean_square()

    def _mean_square(self) -> float:
        # A pair stands for two conjugate bins, so it counts twice. The four real numbers of the
        # edges count once.
        parts = cv2.norm(self._parts.reshape(-1, self._parts.shape[2]), cv2.NORM_L2SQR)
        edges = np.square(self._edges, dtype=np.float64).sum(axis=0)
        return (2 * (parts + float(edges.sum())) - float(edges[:, [0, -1]].sum())) / self._size


def _cross(
    scratch: NDArray[np.float32], before: NDArray[np.float32], floor: float, compare: bool,
    keep: bool,
) -> float:
    """
    Scale bins to magnitude 1 and multiply them; return their least magnitude.

    ``scratch`` (5, m, n) holds real and imaginary parts, and in the end those of the products in
    its last two; ``before`` (2, m, n) are the bins of the previous frame.
    """
    real, imaginary, magnitude, *cross = scratch
    cv2.magnitude(real, imaginary, magnitude=magnitude)
    # Searching for weak bins costs a fifth of lifting them, and they are rare.
    weakest = float(magnitude.min())
    if weakest < floor:
        np.maximum(magnitude, floor, out=magnitude)
    np.divide(real, magnitude, out=real)
    np.divide(imaginary, magnitude, out=imaginary)
    if compare:
        np.multiply(real, before[0], out=cross[0])
        cross[0] += np.multiply(imaginary, before[1], out=magnitude)
        np.multiply(imaginary, before[0], out=cross[1])
        cross[1] -= np.multiply(real, before[1], out=magnitude)
    if keep:
        before[0], before[1] = real, imaginary
    return weakest
