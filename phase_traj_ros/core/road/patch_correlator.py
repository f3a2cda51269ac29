# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures the slide of a road patch towards the vehicle by phase correlation."""

from dataclasses import dataclass
import math

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.spectrum import aligned_zeros, CrossPhase, padded_shape
from phase_traj_ros.core.correlation.transforms import find_transform
from phase_traj_ros.core.road.tuning import TUNING


@dataclass(frozen=True, slots=True)
class Peak:
    """Peak of the map: position in cells towards the vehicle, and height in noise deviations."""

    cells: float
    score: float


class PatchCorrelator:
    """Correlates patches with a reference patch."""

    def __init__(self, window: NDArray[np.float32], *, blur_cells: float = 0.0) -> None:
        """
        Make a correlator for patches of the shape of ``window``, (M, N).

        ``blur_cells`` is the standard deviation of their blur along the road, in cells. Finer
        structure is noise, so the map is smoothed by as much.
        """
        self._window = window
        self._kernel = _gaussian(blur_cells)
        self._reach = reach = len(self._kernel) // 2
        self._transforms = find_transform()
        rows, columns = window.shape
        height, width = padded = padded_shape((rows, columns))
        self._map, self._cross = aligned_zeros(padded), CrossPhase(padded)
        # The offset of the reference, the slides that are searched, and their scores. The map is
        # cyclic.
        self._offset = 0
        self._cells = self._in_place = np.arange(
            -(rows // 4), int(TUNING.longest_slide * rows) + 2)
        self._scores: NDArray[np.float64] = np.zeros(len(self._cells))
        self._search_region = np.ix_(
            np.arange(self._cells[0] - reach, self._cells[-1] + 1 + reach) % height,
            np.arange(-TUNING.lateral_cells, TUNING.lateral_cells + 1) % width)
        self.coherence = 0.0
        """Share of the whitened spectrum that stays in its place, 0 to 1."""
        # Of a window that is the product of a column and a row, the column is enough.
        column = np.sqrt(np.square(window).sum(axis=1, dtype=np.float64))
        overlap = np.correlate(column, column, 'full') / max(float(column @ column), 1e-9)
        self._overlap = np.maximum(overlap[rows - 1 + self._cells], TUNING.min_overlap)

    @property
    def max_cells(self) -> int:
        """Return the largest slide in cells."""
        return int(self._cells[-2])

    def set_reference(self, patch: NDArray[np.float32], offset: int = 0) -> None:
        """Make a patch the reference; it lies ``offset`` cells ahead of those to compare."""
        self._offset = offset
        # The map is cyclic: a slide that is much shorter than the offset must not seem a long one.
        back, most = -self._in_place[0], self._in_place[-1]
        self._cells = self._in_place[:back + max(back + 1, most - offset) + 1] + offset
        self._transform(patch, keep=True)

    def compare(self, patch: NDArray[np.float32]) -> None:
        """
        Compare a patch with the reference, which does not change.

        The unit of the scores is the standard deviation of the map of two unrelated patches, which
        follows from the energy of the whitened spectrum.
        """
        energy = self._transform(patch, keep=False)
        unit = self._transforms.inverse(self._map)
        smoothed = cv2.filter2D(self._map[self._search_region], -1, self._kernel)
        slides = smoothed[self._reach:-self._reach]
        still = slides[self._offset - self._cells[0], TUNING.lateral_cells]
        self.coherence = float(still) / (unit * float(self._kernel.max()))
        best = slides[:len(self._cells)].max(axis=1).astype(np.float64)
        noise = unit * math.sqrt(max(energy, 1e-12) / self._map.size) * cv2.norm(self._kernel)
        self._scores = best / noise

    def peak(self, least: float, most: float) -> Peak | None:
        """Return the highest significant peak from ``least`` to ``most`` cells, or None."""
        # The farther a patch slides, the less it overlaps: a wide peak would be pulled to zero.
        full = self._scores / self._overlap[:len(self._cells)]
        before, middle, after = full[:-2], full[1:-1], full[2:]
        scores, within = self._scores[1:-1], self._within(least, most)[1:-1]
        # The flank of a peak outside the limits does not count.
        peaks = np.flatnonzero(
            within & (before < middle) & (middle >= after) & (scores >= TUNING.min_score))
        if not len(peaks):
            return None
        at = int(peaks[scores[peaks].argmax()])
        bend = before[at] - 2.0 * middle[at] + after[at]
        return Peak(
            self._cells[at + 1] + 0.5 * (before[at] - after[at]) / bend, float(scores[at]))

    def scores_at(self, cells: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the scores of slides, (N,) in cells; NaN beyond the range of the map."""
        return np.interp(cells, self._cells, self._scores, left=np.nan, right=np.nan)

    def max_score(self, least: float, most: float) -> float:
        """Return the highest score from ``least`` to ``most`` cells."""
        return float(self._scores[self._within(least, most)].max(initial=0.0))

    def rival_score(self, cells: float | None) -> float:
        """Return the highest score, except next to a slide of ``cells``."""
        if cells is None:
            return float(self._scores.max(initial=0.0))
        apart = np.abs(self._cells - round(cells)) > TUNING.peak_half_width
        return float(self._scores[apart].max(initial=0.0))

    def _within(self, least: float, most: float) -> NDArray[np.bool_]:
        """Return which of the slides are from ``least`` to ``most`` cells."""
        return (self._cells >= math.floor(least)) & (self._cells <= math.ceil(most))

    def _transform(self, patch: NDArray[np.float32], *, keep: bool) -> float:
        height, width = patch.shape
        self._map[height:] = 0.0
        self._map[:height, width:] = 0.0
        np.multiply(patch, self._window, out=self._map[:height, :width])
        # By Parseval's theorem, the norm is the root mean square of the spectrum.
        norm = cv2.norm(self._map)
        self._transforms.forward(self._map, height)
        return self._cross(self._map, norm, compare=not keep, keep=keep)


def _gaussian(deviation: float) -> NDArray[np.float32]:
    """Return a column (K, 1), K at least 3, whose sum is 1; (0, 1, 0) for a deviation of 0."""
    deviation = max(deviation, 1e-3)
    return np.asarray(cv2.getGaussianKernel(
        2 * math.ceil(2.0 * deviation) + 1, deviation, cv2.CV_32F), np.float32)
