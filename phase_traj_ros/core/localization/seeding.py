# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Makes hypotheses: anywhere on the map, near a point, or near an expected pose."""

from dataclasses import dataclass
import math

import numpy as np
from phase_traj_ros.core.localization.given import Prior, ScaleRange
from phase_traj_ros.core.localization.hypotheses import carried, Hypotheses
from phase_traj_ros.core.localization.roads import Ints, RoadMap
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.core.localization.window import Odometer


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
        return self.retraced(them, odometer)

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
