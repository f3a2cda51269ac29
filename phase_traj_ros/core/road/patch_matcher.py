# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Finds the slide of a road patch despite patterns that do not slide.

Reflections on the windscreen, dirt and the grid of an encoder do not move. On smooth asphalt,
their peak at zero is higher than that of the road. The moving road averages out, so the mean of
the patches is subtracted from each of them. What an encoder copies from frame to frame changes too
often for a mean, but is not in the difference of two frames.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.road.ground import CELL, GroundPatch
from phase_traj_ros.core.road.keyframe import RoadKeyframe
from phase_traj_ros.core.road.patch_correlator import PatchCorrelator, Peak
from phase_traj_ros.core.road.tuning import TUNING


@dataclass(frozen=True, slots=True)
class RoadSlide:
    """Slide of a patch since the keyframe, in camera heights."""

    distance: float
    """Distance travelled, corrected for the change of the pitch."""
    deviation: float
    """Its standard deviation."""
    score: float
    """Height of the peak in standard deviations of noise."""
    depth: float
    """Mean distance ahead of the patch and that of the keyframe."""
    newest_depth: float
    """Distance ahead of the patch."""
    raw: float
    """The slide as measured."""
    fixed: bool
    """Whether it may belong to a pattern that is fixed to the camera."""
    sudden: bool = False
    """Whether it implies harder braking than a vehicle can do."""
    refuted: float = 0.0
    """See ``Travel``."""


def slide_scale(depth: float, tilt: float) -> float:
    """
    Return the factor by which a slide is too large.

    ``depth`` is the mean distance ahead of the two patches, in camera heights, ``tilt`` the pitch
    relative to that for which they are made, in radians, positive down. See ``camera_pitch``.
    """
    return math.exp(2.0 * depth * tilt)


class PatchMatcher:
    """Compares a road patch with that of the keyframe."""

    def __init__(self, patch: GroundPatch, *, least_offset: float) -> None:
        """
        Make a matcher without a keyframe.

        Where the road slides by more than ``least_offset`` camera heights, the patch is compared
        with the stretch from which the road comes.
        """
        self._patch = patch
        self.depth = patch.depth
        """Mean distance of the patch ahead, in camera heights."""
        # Slide of the patch in camera heights per radian of pitch.
        self._slide_per_pitch = 1.0 + patch.depth * patch.depth
        self._correlator, self._change_correlator = (
            PatchCorrelator(patch.window, blur_cells=patch.blur_cells) for _ in range(2))
        # The slide from which on the reference has an offset, and the offsets with which an
        # unknown slide is searched, all in cells.
        self._least_offset = round(least_offset / CELL)
        self._offsets: list[int] = np.linspace(
            0, patch.max_offset, round(patch.max_offset / self._least_offset) + 1,
            dtype=int).tolist()
        # The patches of the newest three frames, and of that of the reference, by their offset.
        self._newest: deque[Callable[[int], NDArray[np.float32]]] = deque(maxlen=3)
        self._key: Callable[[int], NDArray[np.float32]] | None = None
        # The roll of the reference, its patch in place, and the offset of the one that is in the
        # correlator, in cells.
        self._roll, self._reference = 0.0, np.zeros(patch.shape, np.float32)
        self._offset: int | None = None
        # Mean of the newest patches of a moving road, and their number.
        self._pattern, self._patches = np.zeros(patch.shape, np.float32), 0

    def add(self, frame: Frame) -> None:
        """Add a frame (H, W); its patches are projected once they are needed."""
        self._newest.append(cache(partial(self._patch, frame)))

    def restart(self, frame: Frame, roll: float = 0.0) -> None:
        """Make the patch of a frame (H, W), the first of a pair, the reference."""
        self._newest.clear()
        self.add(frame)
        self.set_reference(roll)

    @property
    def is_offset(self) -> bool:
        """Return whether the patch was compared with another stretch of the road."""
        return bool(self._offset)

    @property
    def has_moved(self) -> bool:
        """Return whether the road has moved in the patch; else it may show the vehicle itself."""
        return self._patches >= TUNING.min_patches

    def rests(self) -> bool:
        """Return whether the newest patch shows the road in the same place as the reference."""
        self._refer(0)
        self._correlator.compare(self._upright(self._without_fixed, self._roll))
        return self._correlator.coherence > TUNING.resting_coherence

    def compare(self, turn: NDArray[np.float64], expected: float = 0.0) -> None:
        """
        Compare the newest patch with the reference.

        ``turn`` (3, 3) is the rotation since. The slide is ``expected`` to be about this, in
        camera heights. If that is long, the reference is the stretch from which the road comes.
        """
        cells = round(expected / CELL)
        self._refer(min(cells, self._patch.max_offset) if cells > self._least_offset else 0)
        self._correlator.compare(self._patch.derotated(self._without_fixed, turn, self._roll))

    def set_reference(self, roll: float = 0.0) -> None:
        """
        Make the newest patch the reference for the next ones.

        ``roll`` is that of its frame, relative to the patch, in radians, positive right side down.
        """
        self._key, self._roll = self._newest[-1], roll
        self._reference, self._offset = self._upright(self._without_fixed, roll), None

    def _refer(self, offset: int) -> None:
        """Give the correlator the reference with this offset in cells."""
        if offset != self._offset:
            assert self._key is not None
            self._offset = offset
            self._correlator.set_reference(self._reference if offset == 0 else self._upright(
                self._key(offset), self._roll, offset), offset)

    def learn(self) -> None:
        """Add the newest patch, on which the road has moved, to the mean pattern."""
        self._patches = min(self._patches + 1, TUNING.pattern_patches)
        self._pattern = self._pattern + (
            self._newest[-1](0) - self._pattern) / np.float32(self._patches)

    def deviation(self, key: RoadKeyframe) -> float:
        """Return the standard deviation of a slide in camera heights, without that of the tilt."""
        return math.hypot(TUNING.peak_cells * CELL, self._slide_per_pitch * key.pitch_deviation)

    def find(
        self, least: float, most: float, key: RoadKeyframe, *, tilt: float,
    ) -> RoadSlide | None:
        """
        Return the most significant slide since the keyframe ``key``; None if there is none.

        The search range is ``least`` to ``most`` camera heights; for the ``tilt``, see
        ``slide_scale``.
        """
        depth = self._depth_with(self._offset or 0)
        scale = slide_scale(depth, tilt)
        least, most = least * scale / CELL, min(most * scale / CELL, self._correlator.max_cells)
        # The compensation of the rotation moves a pattern that is fixed to the camera here.
        pattern = -self._slide_per_pitch * key.nod / CELL
        below = min(pattern, 0.0) - TUNING.fixed_cells
        above = max(pattern, 0.0) + TUNING.fixed_cells
        peak = self._peak(least, most, below, above, key)
        if peak is None:
            return None
        raw = peak.cells * CELL
        # The copies of an encoder have side lobes.
        beside = key.drives and abs(raw) < TUNING.profile_begins and (
            self._correlator.max_score(below, above) > peak.score)
        fixed = not self._may_turn_on_the_spot(key) and (beside or below < peak.cells < above)
        return RoadSlide(
            raw / scale, self.deviation(key), peak.score, depth, self.depth, raw,
            fixed, peak.cells < least - TUNING.fixed_cells)

    def scores_of_changes(
        self, ways: NDArray[np.float64], turn: NDArray[np.float64], *, tilt: float,
        roll: float = 0.0,
    ) -> NDArray[np.float64]:
        """
        Return the scores of slides between the two newest frames, by what changes in each.

        The slides ``ways`` are (N,), in camera heights; ``turn`` (3, 3) is the rotation of the
        pair, ``roll`` that of its first frame; for the ``tilt``, see ``slide_scale``. Scores
        beyond the range of the map are NaN; so are all after fewer than three successive frames.
        """
        if len(self._newest) < 3:
            return np.full(len(ways), np.nan)
        first, second, third = self._newest
        change = self._patch.derotated(third(0) - second(0), turn, roll)
        scores = np.full(len(ways), np.nan)
        for offset in self._offsets:
            cells = ways * slide_scale(self._depth_with(offset), tilt) / CELL
            here = cells > offset - self._least_offset // 2
            if not here.any():
                break
            self._change_correlator.set_reference(
                self._upright(second(offset) - first(offset), roll, offset), offset)
            self._change_correlator.compare(change)
            scores[here] = self._change_correlator.scores_at(cells[here])
        return scores

    def is_rivalled(self, found: RoadSlide | None) -> bool:
        """Return whether another slide is significant, and more than the one that was found."""
        cells, score = (None, 0.0) if found is None else (found.raw / CELL, found.score)
        return self._correlator.rival_score(cells) > max(TUNING.min_score, score)

    def _peak(
        self, least: float, most: float, below: float, above: float, key: RoadKeyframe,
    ) -> Peak | None:
        """Return the highest peak; that of a fixed pattern only if nothing slides."""
        if not key.moves or self._may_turn_on_the_spot(key):
            # The vehicle may stand, whatever its last speed was.
            return self._correlator.peak(least, most) or self._correlator.peak(below, above)
        # Traffic that overtakes recedes, so a slide that is in the range of the speed counts, too.
        slid = key.min_slide / CELL
        places = [(max(least, above, slid), most)]
        if not key.passes or key.recedes or most <= 0.0:
            places.append((least, min(most, below, slid)))
        peaks = filter(None, [self._correlator.peak(*place) for place in places])
        peak = max(peaks, key=lambda each: each.score, default=None)
        return peak if peak or key.drives else self._correlator.peak(least, most)

    def _may_turn_on_the_spot(self, key: RoadKeyframe) -> bool:
        """
        Return whether what stays in place is the road, on which the vehicle turns on the spot.

        The compensation of a turn moves what is fixed to the camera aside, and with enough of it
        out of the search range.
        """
        aside = abs(key.yaw) * self.depth / CELL
        return aside > TUNING.lateral_cells + TUNING.peak_half_width and not key.passes

    def _depth_with(self, offset: int) -> float:
        """Return the mean distance ahead of the patch and that with an offset."""
        return self.depth + 0.5 * CELL * offset

    def _upright(
        self, patch: NDArray[np.float32], roll: float, offset: int = 0,
    ) -> NDArray[np.float32]:
        return self._patch.derotated(patch, np.eye(3), roll, offset) if roll else patch

    @property
    def _without_fixed(self) -> NDArray[np.float32]:
        newest = self._newest[-1](0)
        return newest - self._pattern if self.has_moved else newest
