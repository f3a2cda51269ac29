# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures the slide of a road patch towards the vehicle by phase correlation."""

from dataclasses import dataclass
import math

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.aligned import aligned_zeros
from phase_traj_ros.core.correlation.spectrum import CrossPhase, padded_shape
from phase_traj_ros.core.correlation.transforms import find_transform
from phase_traj_ros.core.road.tuning import TUNING


@dataclass(frozen=True, slots=True)
class Peak:
    """Peak of the map: position in cells towards the vehicle, and height in noise deviations."""

    cells: float
    score: float


class Slide:
    """Correlates patches with one that was kept."""

    def __init__(self, window: NDArray[np.float32]) -> None:
        """Make a correlator for patches of the shape of ``window``, (M, N)."""
        self._window = window
        self._transforms = find_transform()
        rows, columns = window.shape
        height, width = padded = padded_shape((rows, columns))
        self._map, self._cross = aligned_zeros(padded), CrossPhase(padded)
        self.most = int(TUNING.longest_slide * rows)
        """Largest slide in cells."""
        self._back = rows // 8
        # The map is cyclic.
        self._searched = np.ix_(
            np.arange(-self._back, self.most + 2) % height,
            np.arange(-TUNING.aside_cells, TUNING.aside_cells + 1) % width)
        self._scores: NDArray[np.float64] = np.zeros(0)

    def keep(self, patch: NDArray[np.float32]) -> None:
        """Keep the patch for the comparison with the next one."""
        self._transform(patch, keep=True)

    def compare(self, patch: NDArray[np.float32]) -> None:
        """
        Compare a patch with the one that was kept, and still is afterwards.

        The map of two unrelated patches is noise. Its standard deviation follows from the energy
        of the whitened spectrum, and is the unit of the scores.
        """
        energy = self._transform(patch, keep=False)
        unit = self._transforms.inverse(self._map)
        best = self._map[self._searched].max(axis=1).astype(np.float64)
        noise = unit * math.sqrt(max(energy, 1e-12) / self._map.size)
        self._scores = best / noise

    def peak(self, least: float, most: float) -> Peak | None:
        """Return the highest peak from ``least`` to ``most`` cells; None if none stands out."""
        first = max(math.floor(least) + self._back, 1)
        last = min(math.ceil(most) + self._back, len(self._scores) - 2)
        if last < first:
            return None
        # The flank of a peak outside does not count, however high it is.
        before, scores, after = (self._scores[first + by:last + 1 + by] for by in (-1, 0, 1))
        peaks = np.flatnonzero(
            (before < scores) & (scores >= after) & (scores >= TUNING.stands_out))
        if not len(peaks):
            return None
        at = int(peaks[scores[peaks].argmax()])
        left, middle, right = before[at], scores[at], after[at]
        bend = left - 2.0 * middle + right
        return Peak(first + at - self._back + 0.5 * (left - right) / bend, float(middle))

    def scores_at(self, cells: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the heights of the map at some slides, (N,) in cells; NaN beyond its range."""
        places = np.arange(len(self._scores)) - self._back
        return np.interp(cells, places, self._scores, left=np.nan, right=np.nan)

    def highest(self, least: float, most: float) -> float:
        """Return the highest score from ``least`` to ``most`` cells."""
        first, last = math.floor(least) + self._back, math.ceil(most) + self._back
        return float(self._scores[max(first, 0):max(last + 1, 1)].max(initial=0.0))

    def rival(self, cells: float | None) -> float:
        """Return the highest score of all slides but those next to ``cells``."""
        scores = self._scores.copy()
        if cells is not None:
            at = round(cells) + self._back
            scores[max(at - TUNING.next_cells, 0):at + TUNING.next_cells + 1] = 0.0
        return float(scores.max())

    def _transform(self, patch: NDArray[np.float32], *, keep: bool) -> float:
        height, width = patch.shape
        self._map[height:] = 0.0
        self._map[:height, width:] = 0.0
        np.multiply(patch, self._window, out=self._map[:height, :width])
        # By Parseval's theorem, the norm is the root mean square of the spectrum.
        norm = cv2.norm(self._map)
        self._transforms.forward(self._map, height)
        return self._cross(self._map, norm, compare=not keep, keep=keep)
