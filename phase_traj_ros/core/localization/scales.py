# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the way between turns tells of the scale, and scales drawn from it.

At a turn, the place along the road is known within metres, so the way since an earlier turn tells
the scale. Hypotheses that survive a turn have few scales; drawn anew, they cover all that fit.
"""

import math

import numpy as np
from phase_traj_ros.core.localization.given import ScaleRange
from phase_traj_ros.core.localization.hypotheses import Floats, Hypotheses, resampled
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.core.localization.window import Stride

# A turn is over when the chord bends less than this, after it bent more.
_TURNING, _STRAIGHT = math.radians(40.0), math.radians(12.0)
_HUNDRED_M = 100.0


class Scales:
    """Draws the scales of hypotheses: from the prior, and after each turn from what it told."""

    def __init__(
        self, scale: ScaleRange, settings: LocatorSettings, rng: np.random.Generator,
    ) -> None:
        """Know the prior."""
        self._middle, self._spread = math.log(scale.middle), spread_of(scale)
        self._settings, self._rng = settings, rng
        # The mean over a longer way is more exact, until the drift of the scale counts more.
        self._longest = (2 * _HUNDRED_M * (settings.turn_m / settings.scale_noise) ** 2) ** (1 / 3)
        self._turning = False
        self._since = 0.0

    def after(
        self, them: Hypotheses, stride: Stride, metres: float, most: int,
    ) -> Hypotheses:
        """Return the hypotheses after a stride; at the end of a turn, about ``most`` new ones."""
        self._since += metres
        self._turning = self._turning or stride.bend > _TURNING
        if not self._turning or stride.bend > _STRAIGHT or not len(them):
            return them
        self._learn(them)
        self._turning, self._since = False, 0.0
        copies = round(float(np.median(self._told(them)[1])) / self._settings.merge_scale)
        if copies < 2:
            return self.drawn(them, 1)
        them = resampled(them, max(most // copies, 1), self._rng)
        return self.drawn(them, max(most // len(them), 1))

    def drawn(self, them: Hypotheses, copies: int) -> Hypotheses:
        """Return copies of the hypotheses, whose scales cover evenly what is known of them."""
        count = len(them)
        ranks = np.concatenate([
            number * count + self._rng.permutation(count) for number in range(copies)])
        them = them.take(np.tile(np.arange(count), copies))
        them.log_weight -= math.log(copies)
        mean, deviation = self._told(them)
        them.log_scale = mean + deviation * _normal_quantile(
            (ranks + self._rng.random(len(ranks))) / max(len(ranks), 1))
        return them

    def _learn(self, them: Hypotheses) -> None:
        """Add the way since the last turn to the means; the first turn only starts them."""
        started = them.told_m >= 0.0
        since = np.where(started, self._since, 0.0)
        way = np.maximum(them.told_m, 0.0) + since
        share = since / np.maximum(way, 1e-9)
        them.told_scale = them.told_scale + share * (them.log_scale - them.told_scale)
        them.told_m = np.minimum(way, self._longest)

    def _told(self, them: Hypotheses) -> tuple[Floats, Floats]:
        """Return mean and standard deviation of the logarithms of the scales, (N,) each."""
        settings, way = self._settings, np.maximum(them.told_m, 1e-3)
        error = (settings.turn_m / way) ** 2 + settings.scale_noise ** 2 * way / _HUNDRED_M
        gain = self._spread ** 2 / (self._spread ** 2 + error)
        mean: Floats = self._middle + gain * (them.told_scale - self._middle)
        deviation: Floats = self._spread * np.sqrt(1.0 - gain)
        return mean, deviation


def spread_of(scale: ScaleRange) -> float:
    """Return the standard deviation of the logarithm of the scale."""
    return scale.half_width / 1.96


def _normal_quantile(share: Floats) -> Floats:
    """
    Return quantiles of the normal distribution, within 0.00045.

    M. Abramowitz and I. A. Stegun, "Handbook of Mathematical Functions", 26.2.23.
    """
    tail = np.clip(np.minimum(share, 1.0 - share), 1e-12, 0.5)
    t = np.sqrt(-2.0 * np.log(tail))
    value = t - (2.515517 + t * (0.802853 + t * 0.010328)) / (
        1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)))
    quantile: Floats = np.where(share < 0.5, -value, value)
    return quantile
