# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Sums what the pairs of half a second show of the speed, where no single one shows it.

In a film of smooth asphalt, an encoder copies most of the road from frame to frame, and what is
left are a few markings. The slide of the copies is 0, their side lobes are at equal slides of all
kinds of pairs, and noise is anywhere. Only the road has a peak at the same speed in most pairs.
"""

import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.road.tuning import TUNING


class SpeedProfile:
    """Mean heights of the maps of all patches, by speed."""

    speeds: NDArray[np.float64] = np.arange(
        TUNING.profile_step, TUNING.fastest, TUNING.profile_step)
    """Speeds in camera heights per second, (N,)."""

    def __init__(self) -> None:
        """Make an empty profile."""
        self.forget()

    def forget(self) -> None:
        """Restart with the next pair."""
        self._sum, self._weight, self._newest = np.zeros((3, len(self.speeds)))

    def pass_time(self, interval: float) -> None:
        """Let the weight of the earlier pairs decrease by an interval in seconds."""
        kept = math.exp(-interval / TUNING.profile_s)
        self._sum *= kept
        self._weight *= kept

    def add(self, scores: NDArray[np.float64], seen: NDArray[np.bool_]) -> None:
        """
        Add a pair.

        ``scores`` is how much the slide at each of ``speeds`` stands out, (N,), in standard
        deviations, and ``seen`` which of them could be seen, (N,).
        """
        self._sum[seen] += scores[seen]
        self._weight[seen] += 1.0
        self._newest = np.where(seen, scores, 0.0)

    def confirms(self, speed: float) -> bool:
        """Return whether a speed is that of half a second."""
        best = self.best
        return best is not None and abs(best[0] - speed) <= TUNING.profile_width * speed

    @property
    def best(self) -> tuple[float, float] | None:
        """Return the speed that stands out from all others, and its score; None if none does."""
        most = float(self._weight.max())
        known = self._weight > max(TUNING.profile_pairs, TUNING.profile_share * most)
        if not known.any():
            return None
        mean = np.where(known, self._sum / np.maximum(self._weight, 1.0), 0.0)
        above = np.where(known, mean - np.median(mean[known]), 0.0)
        at = int(above.argmax())
        if not known[max(at - 1, 0):at + 2].all():
            # The flank of a peak outside.
            return None
        speed = float(self.speeds[at])
        apart = np.abs(self.speeds - speed) > max(
            TUNING.profile_width * speed, 4 * TUNING.profile_step)
        least = max(TUNING.profile_score / math.sqrt(most),
                    TUNING.profile_ratio * float(above[apart].max(initial=0.0)))
        # The newest pair has to agree: the road may be out of sight.
        newest = float(self._newest[at] - np.median(self._newest[known]))
        if above[at] < least or newest < TUNING.profile_newest:
            return None
        return speed, float(mean[at])
