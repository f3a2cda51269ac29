# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How far a patch of the road has slid towards the vehicle: phase correlation of two patches."""

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.aligned import aligned_zeros
from phase_traj_ros.core.correlation.spectrum import CrossPhase, padded_shape
from phase_traj_ros.core.correlation.transforms import find_transform, TransformLibrary

# Cells to either side that count as straight on: a vehicle goes askew a little, and a camera
# ahead of the rear axle moves sideways in a turn.
_ASIDE = 4
# The most that two patches may have slid, as a share of their length.
_MOST = 0.7
# Bins weaker than this share of the root mean square hold rounding noise.
_ROUNDING = 1e-6


@dataclass(frozen=True, slots=True)
class Peak:
    """Where the map is highest: cells, towards the vehicle, and height in units of noise."""

    cells: float
    score: float


class Slide:
    """Holds the newest patch, and says how well the next one fits when slid by so many cells."""

    def __init__(self, window: NDArray[np.float32], transform: TransformLibrary) -> None:
        """Make one for patches of the window's shape, (M, N)."""
        self._window = window
        self._transforms = find_transform(transform)
        self._map = aligned_zeros(padded_shape((window.shape[0], window.shape[1])))
        self._cross = CrossPhase((self._map.shape[0], self._map.shape[1]))
        self.most = int(_MOST * window.shape[0])
        """The most cells that it can have slid."""
        self._scores: NDArray[np.float64] = np.zeros(0)

    def keep(self, patch: NDArray[np.float32]) -> None:
        """Take the patch that the next one is to be compared with."""
        self._transform(patch)

    def compare(self, patch: NDArray[np.float32]) -> None:
        """
        Compare a patch with the one that was kept.

        The map of two patches that have nothing in common is noise of a known deviation, as the
        energy of a whitened spectrum is known: scores are in units of that.
        """
        energy = self._transform(patch)
        unit = self._transforms.inverse(self._map)
        height, width = self._map.shape
        columns = np.arange(-_ASIDE, _ASIDE + 1) % width
        rows = np.arange(-self._back, self.most + 2) % height
        best = self._map[rows[:, None], columns].max(axis=1).astype(np.float64)
        noise = unit * math.sqrt(max(energy, 1e-12) / self._map.size)
        self._scores = best / noise

    def peak(self, least: float, most: float) -> Peak | None:
        """Return the highest place from ``least`` to ``most`` cells; None if none is there."""
        first = max(math.floor(least) + self._back, 1)
        last = min(math.ceil(most) + self._back, len(self._scores) - 2)
        if last < first:
            return None
        at = first + int(self._scores[first:last + 1].argmax())
        left, middle, right = self._scores[at - 1:at + 2]
        bend = left - 2.0 * middle + right
        # At the end of what is looked at, the true one may lie beyond.
        if bend >= 0.0 or max(left, right) > middle:
            return None
        return Peak(at - self._back + 0.5 * (left - right) / bend, float(middle))

    @property
    def _back(self) -> int:
        return len(self._window) // 8

    def _transform(self, patch: NDArray[np.float32]) -> float:
        height, width = patch.shape
        self._map[height:] = 0.0
        self._map[:height, width:] = 0.0
        np.multiply(patch, self._window, out=self._map[:height, :width])
        deviation = math.sqrt(float(np.mean(np.square(self._map))))
        if deviation == 0.0:
            self._cross.clear()
            self._map.fill(0.0)
            return 0.0
        self._transforms.forward(self._map, height)
        return self._cross(self._map, _ROUNDING * deviation * math.sqrt(self._map.size))
