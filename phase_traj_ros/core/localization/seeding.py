# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Makes hypotheses: anywhere on the map, near a point, or near an expected pose.

Also spreads their scales after each turn. There, the place along the road is known within metres,
so that the way to the next turn tells the scale.
"""

from dataclasses import dataclass
import math

import numpy as np
from phase_traj_ros.core.localization.given import Prior, ScaleRange
from phase_traj_ros.core.localization.hypotheses import carried, Hypotheses
from phase_traj_ros.core.localization.roads import Ints, RoadMap
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.core.localization.window import Odometer, Stride

# A scale that is given exactly has this deviation.
_LEAST_SPREAD = 1e-6


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
    log_scale, scale_deviation
        Natural logarithm of the metres per unit of the odometry, and its standard deviation.
    """

    place: complex
    turned: float
    deviation: float
    radius: float
    log_scale: float
    scale_deviation: float


class Scales:
    """Knows the prior of the scale, and what the turns leave open of it."""

    def __init__(self, scale: ScaleRange, settings: LocatorSettings) -> None:
        """Start on a straight way."""
        self.middle, self.spread = math.log(scale.middle), spread_of(scale)
        self._settings = settings
        self._turned = self._since = 0.0

    def after(self, them: Hypotheses, stride: Stride, metres: float) -> int:
        """
        Widen the scales at the end of a turn; return how many copies cover each, 1 elsewhere.

        The place of a turn errs by some metres, for lanes and cut corners, so the way since the
        last one told less than its noise says. The way to the first one told nothing: it may have
        begun anywhere.
        """
        settings = self._settings
        self._since += metres
        if stride.bend > settings.turn_over:
            self._turned += stride.turned
            return 1
        turned, self._turned = abs(self._turned), 0.0
        if turned < settings.least_turn or not len(them):
            return 1
        noise = settings.position_noise_m ** 2 * self._since / 100.0
        share = noise / (noise + settings.turn_m ** 2)
        self._since = 0.0
        first = np.isinf(them.known_variance)
        told = np.maximum(1.0 / them.scale_variance - 1.0 / them.known_variance, 0.0)
        known = np.where(first, self.spread ** 2, them.known_variance)
        them.log_scale = np.where(first, self.middle, them.log_scale)
        them.scale_variance = known / (1.0 + np.where(first, 0.0, share * told) * known)
        them.known_variance = them.scale_variance
        deviation = math.sqrt(float(np.median(them.scale_variance)))
        return max(round(deviation / settings.merge_scale), 1)


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
            np.repeat(near, math.ceil(self._settings.fewest_around / len(near))), odometer,
            log_total)
        if prior.heading is not None:
            off = np.angle(np.exp(1j * (them.turned + odometer.heading - prior.heading)))
            them.log_weight = them.log_weight - (off / prior.heading_deviation) ** 2 / 2
            them.log_weight += log_total - them.log_total
        return them

    def expected(
        self, pose: ExpectedPose, odometer: Odometer, log_total: float,
    ) -> Hypotheses:
        """Return hypotheses on the roads near an expected pose; none if there are no roads."""
        roads, settings = self._roads, self._settings
        near = np.flatnonzero(
            roads.distances_to(pose.place.real, pose.place.imag) <= pose.radius)
        known = pose.deviation < settings.unknown_heading
        if known:
            off = roads.direction[near] - odometer.heading - pose.turned
            near = near[np.abs(np.angle(np.exp(1j * off))) <= (
                2 * settings.mode_heading + 2 * pose.deviation)]
        them = self._on(near, odometer, log_total)
        if known:
            them.turned[:] = pose.turned + pose.deviation * self._rng.standard_normal(len(near))
            them.variance[:] = settings.start_heading ** 2
        them.log_scale[:], them.scale_variance[:] = pose.log_scale, pose.scale_deviation ** 2
        them.known_variance[:] = them.scale_variance
        return self.retraced(them, odometer)

    def _on(self, piece: Ints, odometer: Odometer, log_total: float) -> Hypotheses:
        roads, count = self._roads, len(piece)
        offset = roads.length[piece] * self._rng.random(count)
        turned = roads.direction[piece] - odometer.heading
        them = Hypotheses(
            piece, offset, np.full(count, self._scales.middle),
            np.full(count, self._scales.spread ** 2), np.full(count, np.inf), turned,
            np.full(count, self._settings.start_heading ** 2),
            np.empty((0, count), np.complex128), self._log_chance[piece])
        them.log_weight = them.log_weight + (log_total - them.log_total)
        return self.retraced(them, odometer)

    def retraced(self, them: Hypotheses, odometer: Odometer) -> Hypotheses:
        """Return the hypotheses with the trail of the odometer to where they are."""
        them.trail = carried(
            self._roads.places(them.piece, them.offset), odometer.trail[:, None], them.log_scale,
            them.turned)
        return them


def spread_of(scale: ScaleRange) -> float:
    """Return the standard deviation of the logarithm of the scale."""
    return max(scale.half_width / 1.96, _LEAST_SPREAD)
