# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Moves hypotheses along the roads; where a road branches, they do."""

import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.localization.given import ScaleRange
from phase_traj_ros.core.localization.hypotheses import Floats, Hypotheses, places_on
from phase_traj_ros.core.localization.roads import RoadMap
from phase_traj_ros.core.localization.seeding import spread_of
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.core.localization.window import Stride

_HUNDRED_M = 100.0
# Multiples of it cover the unit interval evenly, however many.
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2


class Motion:
    """How hypotheses move along the roads of a map."""

    def __init__(self, roads: RoadMap, scale: ScaleRange, settings: LocatorSettings) -> None:
        """Prepare the chances at the junctions of a map."""
        self._roads = roads
        self._scale = scale
        self._settings = settings
        turn = _turns(roads)
        self._log_chance = np.log(_chances(roads, turn, settings))
        self._saved = settings.corner_m * _saved(turn, settings.sharp)

    def advance(
        self, them: Hypotheses, stride: Stride, most: int, rng: np.random.Generator,
    ) -> Hypotheses:
        """Return the hypotheses after a stride, of which at most about ``most`` branch further."""
        settings, count = self._settings, len(them)
        share = stride.distance * self._scale.middle / _HUNDRED_M
        deviation = math.hypot(
            settings.position_noise_m * math.sqrt(share),
            math.sqrt(stride.distance_variance) * self._scale.middle)
        expected = stride.distance * np.exp(them.log_scale)
        variance = deviation ** 2 + expected ** 2 * them.scale_variance
        off = np.sqrt(variance) * _stratified(count, rng)
        metres = expected + off
        # Given the metres that were drawn, a Kalman filter tells the scale.
        gain = expected * them.scale_variance / variance
        log_scale, scale_variance = self._drifted(
            them.log_scale + gain * off, them.scale_variance * (1.0 - gain * expected), share)
        scale_variance += stride.scale_variance
        piece, offset, log_weight, parent = self._along(
            them.piece, them.offset + np.maximum(metres, 0.0), them.log_weight, most)
        trail = np.concatenate([
            them.trail[1:].take(parent, axis=1), places_on(self._roads, piece, offset)[None]])
        noise = settings.heading_noise ** 2 * share + stride.yaw_variance
        return Hypotheses(
            piece, offset, log_scale.take(parent), scale_variance.take(parent),
            them.known_variance.take(parent), them.turned.take(parent),
            them.variance.take(parent) + noise, trail, log_weight)

    def _drifted(
        self, log_scale: Floats, variance: Floats, share: float,
    ) -> tuple[Floats, Floats]:
        """Return scales and variances after a drift that keeps the spread of the prior."""
        middle, spread = math.log(self._scale.middle), spread_of(self._scale)
        noise = self._settings.scale_noise * math.sqrt(share)
        kept = math.sqrt(max(1.0 - (noise / spread) ** 2, 0.0))
        noise = min(noise, spread)
        return middle + kept * (log_scale - middle), kept ** 2 * variance + noise ** 2

    def _along(
        self, piece: NDArray[np.int64], offset: NDArray[np.float64],
        log_weight: NDArray[np.float64], most: int,
    ) -> tuple[
            NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
        """Return piece, offset, weight and parent of all that the given ones become."""
        roads = self._roads
        arrived = []
        going = piece, offset, log_weight, np.arange(len(piece))
        while len(going[0]):
            piece, offset, log_weight, parent = going
            inside = offset < roads.length[piece]
            arrived.append(tuple(each[inside] for each in going))
            beyond = np.flatnonzero(~inside)
            if len(beyond) > most:
                # Loops of tiny edges would multiply without end.
                beyond = beyond[np.argpartition(log_weight[beyond], -most)[-most:]]
            begin = roads.first[piece[beyond]]
            branches = roads.first[piece[beyond] + 1] - begin
            source = np.repeat(beyond, branches)
            rank = np.arange(len(source)) - np.repeat(np.cumsum(branches) - branches, branches)
            entry = np.repeat(begin, branches) + rank
            going = (
                roads.successors[entry],
                offset[source] - roads.length[piece[source]] + self._saved[entry],
                log_weight[source] + self._log_chance[entry], parent[source])
        piece, offset, log_weight, parent = (
            np.concatenate(each) for each in zip(*arrived))
        return piece, offset, log_weight, parent

    def turned_back(self, them: Hypotheses, moved: complex, most: int) -> Hypotheses:
        """
        Return hypotheses of before a U-turn on their roads as they are after it.

        ``moved`` is the displacement since, in the axes and the unit of the odometry. The trail
        is not valid.
        """
        roads = self._roads
        ahead = (moved * np.exp(
            them.log_scale + 1j * (them.turned - roads.direction[them.piece]))).real
        piece, offset, log_weight, parent = self._along(
            them.piece, them.offset + np.maximum(ahead, 0.0), them.log_weight, most)
        offset = roads.length[piece] - offset + np.maximum(-ahead[parent], 0.0)
        piece, offset, log_weight, last = self._along(
            roads.reverse[piece], offset, log_weight, most)
        result = them.take(parent[last])
        result.piece, result.offset, result.log_weight = piece, offset, log_weight
        return result


def _stratified(count: int, rng: np.random.Generator) -> Floats:
    """
    Return draws from the standard normal distribution, of which neighbours cover it evenly.

    Hypotheses that were split are neighbours.
    """
    share: Floats = (np.arange(count, dtype=np.float64) * _GOLDEN + rng.random()) % 1.0
    return _normal_quantile(share)


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


def _owners(roads: RoadMap) -> NDArray[np.int64]:
    """Return the piece that each successor follows."""
    return np.repeat(np.arange(len(roads)), np.diff(roads.first))


def _turns(roads: RoadMap) -> NDArray[np.float64]:
    """Return the angle by which each successor turns, from 0 to pi."""
    turn = roads.direction[roads.successors] - roads.direction[_owners(roads)]
    angle: NDArray[np.float64] = np.abs(np.remainder(turn + np.pi, 2 * np.pi) - np.pi)
    return angle


def _chances(
    roads: RoadMap, turn: NDArray[np.float64], settings: LocatorSettings,
) -> NDArray[np.float64]:
    """Return the probability of each successor."""
    owner = _owners(roads)
    chance = np.where(turn < settings.straight, settings.straight_on, np.where(
        turn > settings.sharp, settings.sharp_turn, 1.0))
    chance = np.where(roads.against[roads.successors], settings.wrong_way * chance, chance)
    chance /= np.bincount(owner, chance, len(roads))[owner]
    back = roads.successors == roads.reverse[owner]
    return np.where(back, settings.road_ends, chance)


def _saved(turn: NDArray[np.float64], sharp: float) -> NDArray[np.float64]:
    """Return the way that an arc saves at a corner of so many radians, per metre of its radius."""
    angle = np.where(turn > sharp, 0.0, turn)
    return 2.0 * np.tan(angle / 2) - angle
