# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Makes hypotheses: anywhere on the map, near a point, or around others."""

import math

import numpy as np
from phase_traj_ros.core.localization.given import Prior, ScaleRange
from phase_traj_ros.core.localization.hypotheses import carried, Hypotheses
from phase_traj_ros.core.localization.roads import Ints, RoadMap
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.core.localization.window import Odometer


class Seeding:
    """Makes hypotheses on a map that have seen the newest strides of an odometer."""

    def __init__(
        self, roads: RoadMap, scale: ScaleRange, settings: LocatorSettings,
        rng: np.random.Generator,
    ) -> None:
        """Prepare a map."""
        self._roads, self._scale, self._settings, self._rng = roads, scale, settings, rng
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
            found.append(self.retraced(new, odometer))
        return found[0].joined(*found[1:])

    def _on(self, piece: Ints, odometer: Odometer, log_total: float) -> Hypotheses:
        roads, count = self._roads, len(piece)
        offset = roads.length[piece] * self._rng.random(count)
        turned = roads.direction[piece] - odometer.heading
        them = Hypotheses(
            piece, offset, np.full(count, math.log(self._scale.middle)),
            np.full(count, self._scale.deviation ** 2), turned,
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
