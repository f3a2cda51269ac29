# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Moves hypotheses along the roads, and branches them at junctions."""

from dataclasses import replace
import math

import numpy as np
from phase_traj_ros.core.localization.filter.hypotheses import displaced, Hypotheses, wrapped
from phase_traj_ros.core.localization.filter.strides import Stride
from phase_traj_ros.core.localization.given import ScaleRange
from phase_traj_ros.core.localization.roads import Floats, parts_of, RoadMap
from phase_traj_ros.core.localization.settings import LocatorSettings

# The fractional parts of its multiples are evenly distributed over the unit interval.
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2


class MotionModel:
    """Predicts how hypotheses move along the roads of a map."""

    def __init__(
        self, roads: RoadMap, scale: ScaleRange, settings: LocatorSettings,
        rng: np.random.Generator,
    ) -> None:
        """Compute the transition probabilities at the junctions of a map."""
        self._roads, self._scale, self._settings, self._rng = roads, scale, settings, rng
        self._log_chance, self._saved = _transitions(roads, settings)

    def advance(self, hypotheses: Hypotheses, stride: Stride, most: int) -> Hypotheses:
        """Return the hypotheses after a stride; at most ``most`` at once pass to a next piece."""
        settings = self._settings
        share = stride.distance * self._scale.middle / 100.0
        deviation = math.hypot(
            settings.position_noise_m * math.sqrt(share),
            math.sqrt(stride.distance_variance) * self._scale.middle)
        expected = stride.distance * np.exp(hypotheses.log_scale)
        variance = deviation ** 2 + expected ** 2 * hypotheses.scale_variance
        off = np.sqrt(variance) * _stratified(len(hypotheses), self._rng)
        # A Kalman filter updates the scale by the distance that was drawn.
        gain = expected * hypotheses.scale_variance / variance
        log_scale = hypotheses.log_scale + gain * off
        scale_variance = hypotheses.scale_variance * (1.0 - gain * expected)
        # The drift reverts to the mean, so that the spread never exceeds that of the prior.
        middle, spread = math.log(self._scale.middle), self._scale.log_deviation
        drift = min(settings.scale_noise * math.sqrt(share), spread)
        kept = math.sqrt(1.0 - (drift / spread) ** 2)
        noise = settings.heading_noise ** 2 * share + stride.yaw_variance
        moved = self._along(replace(
            hypotheses, offset=hypotheses.offset + np.maximum(expected + off, 0.0),
            log_scale=middle + kept * (log_scale - middle),
            scale_variance=kept ** 2 * scale_variance + drift ** 2 + stride.scale_variance,
            rotation_variance=hypotheses.rotation_variance + noise,
            trail=hypotheses.trail[1:]), most)
        moved.trail = np.concatenate([
            moved.trail, self._roads.positions(moved.piece, moved.offset)[None]])
        return moved

    def _along(self, hypotheses: Hypotheses, most: int) -> Hypotheses:
        """Return the hypotheses with offsets beyond their pieces carried on to all successors."""
        if not len(hypotheses):
            return hypotheses
        roads = self._roads
        arrived = []
        going = (
            hypotheses.piece, hypotheses.offset, hypotheses.log_weight,
            np.arange(len(hypotheses)))
        while len(going[0]):
            piece, offset, log_weight, parent = going
            inside = offset < roads.length[piece]
            arrived.append(tuple(each[inside] for each in going))
            beyond = np.flatnonzero(~inside)
            if len(beyond) > most:
                # Loops of very short edges would multiply the hypotheses without end.
                beyond = beyond[np.argpartition(log_weight[beyond], -most)[-most:]]
            begin = roads.first[piece[beyond]]
            owner, rank = parts_of(roads.first[piece[beyond] + 1] - begin)
            source, entry = beyond[owner], begin[owner] + rank
            going = (
                roads.successors[entry],
                offset[source] - roads.length[piece[source]] + self._saved[entry],
                log_weight[source] + self._log_chance[entry], parent[source])
        piece, offset, log_weight, parent = map(np.concatenate, zip(*arrived))
        found = hypotheses.take(parent)
        found.piece, found.offset, found.log_weight = piece, offset, log_weight
        return found

    def turned_back(self, hypotheses: Hypotheses, moved: complex, most: int) -> Hypotheses:
        """
        Return the hypotheses from before a U-turn, moved to the opposite direction of their roads.

        ``moved`` is the displacement during the U-turn, in the axes and the unit of the odometry.
        The trail of the result is not valid.
        """
        back = replace(hypotheses, offset=hypotheses.offset + self._ahead(hypotheses, moved))
        return self._along(self.facing_back(self._along(back, most)), most)

    def unobserved(
        self, hypotheses: Hypotheses, since: complex, farthest: float, most: int,
    ) -> Hypotheses:
        """
        Return the hypotheses after an unobserved motion, forwards or backwards along their roads.

        It was of up to ``farthest`` metres, all equally probable. ``since`` is the displacement
        from the last stride to its start, in the axes and the unit of the odometry. The trail of
        the result is not valid.
        """
        way = farthest * self._rng.uniform(-1.0, 1.0, len(hypotheses))
        moved = replace(
            hypotheses, offset=hypotheses.offset + self._ahead(hypotheses, since) + way)
        behind = moved.offset < 0.0
        ahead, back = (moved.take(np.flatnonzero(part)) for part in (~behind, behind))
        return self._along(ahead, most).joined(
            self.facing_back(self._along(self.facing_back(back), most)))

    def _ahead(self, hypotheses: Hypotheses, moved: complex) -> Floats:
        """Return a displacement of the odometry along the roads of the hypotheses, in metres."""
        along: Floats = displaced(
            0.0, moved, hypotheses.log_scale,
            hypotheses.rotation - self._roads.direction[hypotheses.piece]).real
        return along

    def facing_back(self, hypotheses: Hypotheses) -> Hypotheses:
        """Return the hypotheses at the same places in the opposite direction of their roads."""
        roads, piece = self._roads, hypotheses.piece
        return replace(
            hypotheses, piece=roads.reverse[piece], offset=roads.length[piece] - hypotheses.offset)


def _stratified(count: int, rng: np.random.Generator) -> Floats:
    """
    Return draws from the standard normal distribution, stratified over neighbours, (count,).

    Copies of one hypothesis are neighbours. The quantiles have an error below 0.00045:
    M. Abramowitz and I. A. Stegun, "Handbook of Mathematical Functions", 26.2.23.
    """
    share = (np.arange(count, dtype=np.float64) * _GOLDEN + rng.random()) % 1.0
    tail = np.clip(np.minimum(share, 1.0 - share), 1e-12, 0.5)
    t = np.sqrt(-2.0 * np.log(tail))
    value = t - (2.515517 + t * (0.802853 + t * 0.010328)) / (
        1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)))
    quantile: Floats = np.where(share < 0.5, -value, value)
    return quantile


def _transitions(roads: RoadMap, settings: LocatorSettings) -> tuple[Floats, Floats]:
    """Return the log-probability of each successor, and the metres saved by cutting the corner."""
    owner, _ = parts_of(np.diff(roads.first))
    turn = np.abs(wrapped(roads.direction[roads.successors] - roads.direction[owner]))
    sharp = turn > settings.sharp
    chance = np.where(turn < settings.straight, settings.straight_on, np.where(
        sharp, settings.sharp_turn, 1.0))
    chance = np.where(roads.against[roads.successors], settings.wrong_way * chance, chance)
    chance /= np.bincount(owner, chance, len(roads))[owner]
    back = roads.successors == roads.reverse[owner]
    angle = np.where(sharp, 0.0, turn)
    saved = settings.corner_m * (2.0 * np.tan(angle / 2) - angle)
    return np.log(np.where(back, settings.road_ends, chance)), saved
