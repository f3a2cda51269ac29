# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Looks for the slide of one patch of the road, beside patterns that do not slide.

Reflections on the windscreen, dirt and the grid of an encoder do not move, and where the asphalt
shows little, their peak at zero is higher than that of the road. The road itself averages out
while it passes by, so what all patches have in common is subtracted from them.
"""

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.road.ground import CELL, GroundPatch
from phase_traj_ros.core.road.keyframe import RoadKeyframe
from phase_traj_ros.core.road.slide import Peak, Slide
from phase_traj_ros.core.road.tuning import TUNING


@dataclass(frozen=True, slots=True)
class RoadSlide:
    """Slide of a patch since the keyframe, in camera heights."""

    way: float
    """The distance travelled, corrected for the change of the pitch."""
    deviation: float
    """Its standard deviation."""
    score: float
    """Height of its peak in standard deviations of noise."""
    middle: float
    """Distance of the patch ahead."""
    raw: float
    """The slide as measured."""
    fixed: bool
    """Whether it may be that of a pattern that is fixed to the camera."""
    sudden: bool = False
    """Whether no vehicle brakes as hard."""


class RoadLook:
    """A patch of the road, compared with that of the keyframe."""

    def __init__(self, patch: GroundPatch) -> None:
        """Make a comparison without a keyframe."""
        self._patch = patch
        self._slide = Slide(patch.window)
        self._newest: NDArray[np.float32] = np.zeros(patch.shape, np.float32)
        # The mean of the newest patches of a road that has moved on, and their number.
        self._pattern, self._patches = self._newest, 0

    @property
    def middle(self) -> float:
        """Return the distance of the patch ahead, in camera heights."""
        return self._patch.middle

    def look(self, frame: Frame) -> None:
        """Take the patch of a frame (H, W)."""
        self._newest = self._patch(frame)

    def compare(self, turn: NDArray[np.float64]) -> None:
        """Compare the newest patch with the kept one; ``turn`` (3, 3) is the rotation since."""
        self._slide.compare(self._patch.turned_back(self._without_fixed, turn))

    def keep(self) -> None:
        """Keep the newest patch for the comparison with the next ones."""
        self._slide.keep(self._without_fixed)

    def learn(self) -> None:
        """Learn from the newest patch what does not move: the road has moved on."""
        self._patches = min(self._patches + 1, TUNING.pattern_patches)
        self._pattern = self._pattern + (
            self._newest - self._pattern) / np.float32(self._patches)

    def deviation(self, key: RoadKeyframe) -> float:
        """Return the standard deviation of a slide in camera heights, apart from the tilt."""
        return math.hypot(TUNING.peak_cells * CELL, self._swing * key.nodding)

    def find(
        self, least: float, most: float, key: RoadKeyframe, *, stretched: float,
    ) -> RoadSlide | None:
        """
        Return the slide since the keyframe ``key`` that stands out most; None if none does.

        It is searched from ``least`` to ``most`` camera heights. ``stretched`` is the factor by
        which slides of this patch are too large, as the pitch has changed.
        """
        least, most = least * stretched / CELL, min(most * stretched / CELL, self._slide.most)
        # Where the rotation takes a pattern that is fixed to the camera, and around it.
        pattern = -self._swing * key.pitch / CELL
        below = min(pattern, 0.0) - TUNING.fixed_cells
        above = max(pattern, 0.0) + TUNING.fixed_cells
        peak = self._peak(least, most, below, above, key)
        if peak is None:
            return None
        raw = peak.cells * CELL
        # Next to the copies of an encoder are their side lobes.
        beside = key.drives and abs(raw) < TUNING.profile_begins and (
            self._slide.highest(below, above) > peak.score)
        return RoadSlide(
            raw / stretched, self.deviation(key), peak.score, self.middle, raw,
            beside or below < peak.cells < above, peak.cells < least - TUNING.fixed_cells)

    def scores_at(
        self, ways: NDArray[np.float64], *, stretched: float,
    ) -> NDArray[np.float64]:
        """Return how much some slides, (N,) in camera heights, stand out; NaN if out of sight."""
        return self._slide.scores_at(ways * stretched / CELL)

    def is_rivalled(self, found: RoadSlide | None) -> bool:
        """Return whether another slide stands out, and more than the one that was found."""
        cells, score = (None, 0.0) if found is None else (found.raw / CELL, found.score)
        return self._slide.rival(cells) > max(TUNING.stands_out, score)

    def _peak(
        self, least: float, most: float, below: float, above: float, key: RoadKeyframe,
    ) -> Peak | None:
        """Return the highest peak; what slides is the road, even if a fixed pattern is higher."""
        if not key.moves:
            # Whatever its speed was, it may stand.
            return self._slide.peak(least, most) or self._slide.peak(below, above)
        places = [(max(least, above, key.least / CELL), most)]
        if not key.drives or not key.agreed or most <= 0.0:
            places.append((least, min(most, below)))
        peaks = filter(None, [self._slide.peak(*place) for place in places])
        peak = max(peaks, key=lambda each: each.score, default=None)
        return peak if peak or key.drives else self._slide.peak(least, most)

    @property
    def _without_fixed(self) -> NDArray[np.float32]:
        if self._patches < TUNING.least_patches:
            return self._newest
        return self._newest - self._pattern

    @property
    def _swing(self) -> float:
        """Return by how many camera heights the patch slides per radian of pitch."""
        return 1.0 + self.middle * self.middle
