# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Averages the correlation maps of several pairs by speed, where no single pair shows the speed.

In a film of smooth asphalt, an encoder copies most of the road from frame to frame, and only a few
markings remain. The maps are those of what changes from frame to frame, in which copies hardly
show. Noise is at another slide in every pair, and only the road has a peak at the same speed in
most pairs of half a second, or of five intervals if that is longer.
"""

import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.road.tuning import TUNING


class SpeedProfile:
    """Mean heights of the maps of all patches, by speed."""

    speeds: NDArray[np.float64] = np.arange(
        TUNING.profile_step, TUNING.max_speed, TUNING.profile_step)
    """Speeds in camera heights per second, (N,)."""

    def __init__(self) -> None:
        """Make an empty profile."""
        self._sum, self._weight, self._newest = np.zeros((3, len(self.speeds)))
        self.time = TUNING.profile_s
        """Time constant of the mean, in seconds."""

    def predict(self, interval: float) -> None:
        """Reduce the weight of the earlier pairs by an interval in seconds."""
        kept = math.exp(-interval / self.time)
        # After the first use of this interval, in which frames may be missing.
        self.time = max(TUNING.profile_s, TUNING.profile_intervals * interval)
        self._sum *= kept
        self._weight *= kept

    def add(self, scores: NDArray[np.float64], seen: NDArray[np.bool_]) -> None:
        """
        Add a pair.

        ``scores`` are those of the slide at each of ``speeds``, (N,), in standard deviations;
        ``seen`` is whether each is within the range of the map, (N,).
        """
        self._sum[seen] += scores[seen]
        self._weight[seen] += 1.0
        self._newest = np.where(seen, scores, 0.0)

    def confirms(self, speed: float) -> bool:
        """Return whether a speed agrees with that of the profile."""
        found = self._find()
        return found is not None and abs(found[0] - speed) <= TUNING.profile_width * speed

    @property
    def best(self) -> tuple[float, float] | None:
        """Return the most significant speed and its score; None if none is significant."""
        found = self._find()
        # The newest pair has to agree: the road may be out of sight.
        return found[:2] if found and found[2] >= TUNING.profile_newest else None

    def _find(self) -> tuple[float, float, float] | None:
        """Return the best speed, its score, and its height in the newest pair."""
        most = float(self._weight.max())
        known = self._weight > max(TUNING.profile_pairs, TUNING.profile_share * most)
        if not known.any():
            return None
        mean = np.where(known, self._sum / np.maximum(self._weight, 1.0), 0.0)
        above = np.where(known, mean - np.median(mean[known]), 0.0)
        at = int(above.argmax())
        if not known[max(at - 1, 0):at + 2].all():
            # It is the flank of a peak outside the known range.
            return None
        speed = float(self.speeds[at])
        apart = np.abs(self.speeds - speed) > max(
            TUNING.profile_width * speed, 4 * TUNING.profile_step)
        least = max(TUNING.profile_score / math.sqrt(most),
                    TUNING.profile_ratio * float(above[apart].max(initial=0.0)))
        if above[at] < least:
            return None
        return speed, float(mean[at]), float(self._newest[at] - np.median(self._newest[known]))
