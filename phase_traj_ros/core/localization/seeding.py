# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Makes hypotheses: anywhere on the map, near a point, or near an expected pose.

After a turn, it makes more of them. There, the place along the road is known within metres, so the
way since an earlier turn tells the scale. Hypotheses that survive a turn have few scales; drawn
anew, they cover all that fit.
"""

from dataclasses import dataclass
import math

import numpy as np
from phase_traj_ros.core.localization.given import Prior, ScaleRange
from phase_traj_ros.core.localization.hypotheses import (
    Floats,
    Hypotheses,
    Ints,
    places_on,
    resampled,
)
from phase_traj_ros.core.localization.roads import RoadMap
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.core.localization.window import Odometer, Stride

# Hypotheses around a point, at least: several on each piece of road.
_FEWEST = 4_000
# Metres over which the scale of a place that has led is known.
_TOLD_M = 300.0
# Deviation of a heading that counts as unknown, in radians.
_UNKNOWN_HEADING = math.radians(60.0)

# A turn is over when the chord bends less than this, after it bent more.
_TURNING, _STRAIGHT = math.radians(40.0), math.radians(12.0)
_HUNDRED_M = 100.0


@dataclass(frozen=True, slots=True)
class ExpectedPose:
    """
    Pose that the odometry leads to from the last known place.

    place
        As a complex number in metres.
    turned, deviation
        Rotation from the axes of the odometry to those of the map, and its standard deviation.
    radius
        Distance that the place may be off.
    log_scale
        Natural logarithm of the metres per unit of the odometry.
    """

    place: complex
    turned: float
    deviation: float
    radius: float
    log_scale: float


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


class Seeding:
    """Makes hypotheses on a map that have seen the newest strides of an odometer."""

    def __init__(
        self, roads: RoadMap, scales: Scales, settings: LocatorSettings,
        rng: np.random.Generator,
    ) -> None:
        """Prepare a map."""
        self._roads, self._scales, self._settings, self._rng = roads, scales, settings, rng
        self._log_chance = np.log(
            roads.length * np.where(roads.against, settings.wrong_way, 1.0))

    def anywhere(
        self, odometer: Odometer, log_total: float, *, copies: int = 1,
    ) -> Hypotheses:
        """Return hypotheses on each piece of road, of a given total weight."""
        return self._on(np.repeat(np.arange(len(self._roads)), copies), odometer, log_total)

    def around(self, prior: Prior, odometer: Odometer, log_total: float) -> Hypotheses:
        """
        Return hypotheses on the roads around a point.

        Raises
        ------
        ValueError
            There is no road around it.

        """
        apart = self._roads.distances_to(prior.x, prior.y)
        near = np.flatnonzero(apart <= prior.radius)
        if not len(near):
            raise ValueError(
                f'no road is within {prior.radius:.0f} m of the prior; the nearest one is'
                f' {apart.min():.0f} m away: move the prior, enlarge its radius, or use another'
                ' map')
        them = self._on(
            np.repeat(near, math.ceil(_FEWEST / len(near))), odometer, log_total)
        if prior.heading is not None:
            off = np.angle(np.exp(1j * (them.turned + odometer.heading - prior.heading)))
            them.log_weight = them.log_weight - (off / prior.heading_deviation) ** 2 / 2
            them.log_weight += log_total - them.log_total
        return them

    def expected(
        self, pose: ExpectedPose, odometer: Odometer, log_total: float,
    ) -> Hypotheses | None:
        """Return hypotheses on the roads near an expected pose; None if there are none."""
        roads, settings = self._roads, self._settings
        near = np.flatnonzero(
            roads.distances_to(pose.place.real, pose.place.imag) <= pose.radius)
        known = pose.deviation < _UNKNOWN_HEADING
        if known:
            off = roads.direction[near] - odometer.heading - pose.turned
            near = near[np.abs(np.angle(np.exp(1j * off))) <= (
                2 * settings.mode_heading + 2 * pose.deviation)]
        if not len(near):
            return None
        them = self._on(near, odometer, log_total)
        if known:
            them.turned[:] = pose.turned + pose.deviation * self._rng.standard_normal(len(near))
            them.variance[:] = settings.start_heading ** 2
        them.log_scale = pose.log_scale + settings.merge_scale * self._rng.standard_normal(
            len(near))
        them.told_scale = them.log_scale
        them.told_m[:] = _TOLD_M
        return self.retraced(them, odometer)

    def _on(self, piece: Ints, odometer: Odometer, log_total: float) -> Hypotheses:
        roads, count = self._roads, len(piece)
        offset = roads.length[piece] * self._rng.random(count)
        turned = roads.direction[piece] - odometer.heading
        them = self._scales.drawn(Hypotheses(
            piece, offset, np.empty(count), np.zeros(count), np.full(count, -1.0), turned,
            np.full(count, self._settings.start_heading ** 2),
            np.empty((count, 0), np.complex128), self._log_chance[piece]), 1)
        them.log_weight = them.log_weight + (log_total - them.log_total)
        return self.retraced(them, odometer)

    def retraced(self, them: Hypotheses, odometer: Odometer) -> Hypotheses:
        """Return the hypotheses with the trail of the odometer to where they are."""
        turn = np.exp(them.log_scale + 1j * them.turned)
        places = places_on(self._roads, them.piece, them.offset)
        them.trail = places[:, None] + turn[:, None] * np.array(odometer.trail)
        return them


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
