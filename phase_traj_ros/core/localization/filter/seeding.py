# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Creates hypotheses: anywhere on the map, around a point, or around other hypotheses."""

import math

import numpy as np
from phase_traj_ros.core.localization.filter.hypotheses import displaced, Hypotheses, wrapped
from phase_traj_ros.core.localization.filter.strides import DeadReckoning
from phase_traj_ros.core.localization.given import Prior, ScaleRange
from phase_traj_ros.core.localization.roads import Floats, Ints, RoadMap
from phase_traj_ros.core.localization.settings import LocatorSettings


class Seeding:
    """Creates hypotheses on a map, with the trail of the dead reckoning."""

    def __init__(
        self, roads: RoadMap, scale: ScaleRange, settings: LocatorSettings,
        rng: np.random.Generator, reckoning: DeadReckoning,
    ) -> None:
        """
        Prepare a map.

        ``scale`` is the prior of the scale. ``reckoning`` gives the heading and the trail that all
        hypotheses share; each call reads its current state.
        """
        self._roads, self._scale, self._settings, self._rng = roads, scale, settings, rng
        self._reckoning = reckoning
        self._log_chance = np.log(roads.length * np.where(roads.against, settings.wrong_way, 1.0))

    def anywhere(self, log_total: float, *, copies: int = 1) -> Hypotheses:
        """Return ``copies`` hypotheses per piece of road, with a given total weight."""
        return self._on(np.repeat(np.arange(len(self._roads)), copies), log_total)

    def around(self, prior: Prior, log_total: float) -> Hypotheses:
        """
        Return hypotheses on the roads within a prior, with a given total weight.

        Raises
        ------
        ValueError
            No road is within the prior.

        """
        apart = self._roads.distances_to(prior.x, prior.y)
        near = np.flatnonzero(apart <= prior.radius)
        if not len(near):
            raise ValueError(
                f'no road is within {prior.radius:.0f} m of the prior; the nearest one is'
                f' {apart.min():.0f} m away: move the prior, enlarge its radius, or use another'
                ' map')
        return self._on(
            np.repeat(near, math.ceil(self._settings.fewest_around / len(near))), log_total)

    def spread(
        self, hypotheses: Hypotheses, radius: float, turn: float, since: complex,
    ) -> Hypotheses:
        """
        Return hypotheses on the roads around each of others, after an unobserved motion.

        Parameters
        ----------
        hypotheses
            The others, at least one.
        radius
            Largest distance that the vehicle may have moved, in metres.
        turn
            Standard deviation of the unobserved change of the heading in radians.
        since
            Displacement of the odometry from the last stride to the interruption, at which the
            dead reckoning has begun a new stride.

        """
        roads, settings, found = self._roads, self._settings, []
        # After a long gap, each of the others may be anywhere on the map.
        most = max(settings.most_hypotheses // len(hypotheses), 1)
        for number, position in enumerate(hypotheses.displaced(since)):
            near = np.flatnonzero(roads.distances_to(position.real, position.imag) <= radius)
            deviation = math.hypot(turn, math.sqrt(hypotheses.rotation_variance[number]))
            known = deviation < settings.unknown_heading
            if known:
                off = self._rotation_on(near) - hypotheses.rotation[number]
                near = near[np.abs(wrapped(off)) <= (
                    2 * settings.mode_heading + 2 * deviation)]
            if len(near) > most:
                near = np.sort(self._rng.choice(near, most, replace=False))
            new = self._on(near, float(hypotheses.log_weight[number]))
            if known:
                new.rotation[:] = hypotheses.rotation[number] + deviation * (
                    self._rng.standard_normal(len(near)))
            new.log_scale[:] = hypotheses.log_scale[number]
            new.scale_variance[:] = hypotheses.scale_variance[number]
            new.known_variance[:] = hypotheses.known_variance[number]
            found.append(self.retraced(new))
        return found[0].joined(*found[1:])

    def _on(self, piece: Ints, log_total: float) -> Hypotheses:
        """Return hypotheses at random offsets on pieces of road, with a given total weight."""
        count = len(piece)
        offset = self._roads.length[piece] * self._rng.random(count)
        hypotheses = Hypotheses(
            piece, offset, np.full(count, math.log(self._scale.middle)),
            np.full(count, self._scale.log_deviation ** 2), np.full(count, np.inf),
            self._rotation_on(piece), np.full(count, self._settings.start_heading ** 2),
            np.empty((0, count), np.complex128), self._log_chance[piece])
        hypotheses.log_weight += log_total - hypotheses.log_total
        return self.retraced(hypotheses)

    def _rotation_on(self, piece: Ints) -> Floats:
        """Return the rotation of a vehicle that faces along each piece of road, in radians."""
        rotation: Floats = self._roads.direction[piece] - self._reckoning.heading
        return rotation

    def aligned(self, hypotheses: Hypotheses, turn: float) -> Hypotheses:
        """
        Turn hypotheses towards their roads after an unobserved turn; return the same.

        The standard deviation of the turn is ``turn`` radians. The direction of the road is one
        measurement of the heading, also for the weights; their sum stays.
        """
        settings, total = self._settings, hypotheses.log_total
        off = wrapped(self._rotation_on(hypotheses.piece) - hypotheses.rotation)
        unsure = hypotheses.rotation_variance + turn ** 2
        variance = unsure + settings.start_heading ** 2
        gain = unsure / variance
        hypotheses.rotation = hypotheses.rotation + gain * off
        hypotheses.rotation_variance = unsure * (1.0 - gain)
        hypotheses.log_weight = hypotheses.log_weight - (
            settings.tempering * off ** 2 / (2 * variance))
        hypotheses.log_weight += total - hypotheses.log_total
        return hypotheses

    def facing(self, hypotheses: Hypotheses) -> Hypotheses:
        """Set the rotations to those of vehicles that face along their roads; return the same."""
        hypotheses.rotation = self._rotation_on(hypotheses.piece)
        hypotheses.rotation_variance = np.full(
            len(hypotheses), self._settings.start_heading ** 2)
        return hypotheses

    def retraced(self, hypotheses: Hypotheses) -> Hypotheses:
        """Set the trails to that of the dead reckoning up to each position; return the same."""
        hypotheses.trail = displaced(
            self._roads.positions(hypotheses.piece, hypotheses.offset),
            self._reckoning.trail[:, None], hypotheses.log_scale, hypotheses.rotation)
        return hypotheses
