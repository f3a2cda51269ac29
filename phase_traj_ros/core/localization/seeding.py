# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Makes hypotheses: anywhere on the map, near a point, or around others.

Also spreads their scales after each turn. There, the place along the road is known within metres,
so that the way to the next turn tells the scale.
"""

import math

import numpy as np
from phase_traj_ros.core.localization.given import Prior, ScaleRange
from phase_traj_ros.core.localization.hypotheses import carried, Hypotheses
from phase_traj_ros.core.localization.roads import Ints, RoadMap
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.core.localization.window import Odometer, Stride

# A scale that is given exactly has this deviation.
_LEAST_SPREAD = 1e-6


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

    def spread(
        self, them: Hypotheses, since: complex, radius: float, turn: float, odometer: Odometer,
    ) -> Hypotheses:
        """
        Return hypotheses on the roads around each of others, after an unseen motion.

        Parameters
        ----------
        them
            The others.
        since
            Displacement of the odometry since they were moved.
        radius
            Metres that the vehicle may have moved.
        turn
            Standard deviation of the unseen change of the heading in radians.
        odometer
            The odometer.

        """
        roads, settings, found = self._roads, self._settings, []
        for number, place in enumerate(them.carried(since)):
            near = np.flatnonzero(roads.distances_to(place.real, place.imag) <= radius)
            deviation = math.hypot(turn, math.sqrt(them.variance[number]))
            known = deviation < settings.unknown_heading
            if known:
                off = roads.direction[near] - odometer.heading - them.turned[number]
                near = near[np.abs(np.angle(np.exp(1j * off))) <= (
                    2 * settings.mode_heading + 2 * deviation)]
            new = self._on(near, odometer, float(them.log_weight[number]))
            if known:
                new.turned[:] = them.turned[number] + deviation * (
                    self._rng.standard_normal(len(near)))
            new.log_scale[:] = them.log_scale[number]
            new.scale_variance[:] = them.scale_variance[number]
            new.known_variance[:] = new.scale_variance
            found.append(self.retraced(new, odometer))
        return found[0].joined(*found[1:])

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
