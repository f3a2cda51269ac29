# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Finds the places where the weight of the hypotheses gathers."""

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.localization.filter.hypotheses import displaced, Hypotheses, wrapped
from phase_traj_ros.core.localization.roads import Floats, RoadMap
from phase_traj_ros.core.localization.settings import LocatorSettings


@dataclass(frozen=True, slots=True)
class Place:
    """
    A place, summed up from the hypotheses near it.

    position
        Mean position at the end of the last stride, x + iy in metres.
    rotation
        Mean rotation from the axes of the odometry to those of the map, in radians.
    probability
        Share of the total weight.
    covariance
        Covariance of x, y and the rotation, (3, 3), in metres and radians.
    log_scale, scale_deviation
        Mean and standard deviation of the natural logarithm of the metres per unit of the
        odometry.
    """

    position: complex
    rotation: float
    probability: float
    covariance: Floats
    log_scale: float
    scale_deviation: float

    def displaced(self, by: complex) -> complex:
        """Return the position after a displacement of the odometry, x + iy in metres."""
        return complex(displaced(self.position, by, self.log_scale, self.rotation))


class Places:
    """Finds the most probable places on a map."""

    def __init__(self, roads: RoadMap, settings: LocatorSettings) -> None:
        """Assign the pieces of a map to cells of position and direction."""
        self._settings = settings
        columns, rows = np.floor(roads.middles.T / settings.mode_m).astype(np.int64)
        columns, rows = columns - columns.min(), rows - rows.min()
        count = settings.sectors
        sector = np.floor(roads.direction / (2 * np.pi / count)).astype(np.int64) % count
        _, cell = np.unique(
            (columns * (rows.max() + 1) + rows) * count + sector, return_inverse=True)
        self._cell = cell.reshape(-1)
        self._cells = int(self._cell.max()) + 1

    def best(self, hypotheses: Hypotheses, log_total: float) -> list[Place]:
        """
        Return the most probable places, best first, at least one.

        ``log_total`` is the logarithm of the total weight, including the null hypothesis.
        """
        settings = self._settings
        weight = np.exp(hypotheses.log_weight - log_total)
        cell = self._cell[hypotheses.piece]
        mass = np.bincount(cell, weight, self._cells)
        # Once a place is known, only a few cells have hypotheses.
        top = np.flatnonzero(np.bincount(cell))
        if len(top) > settings.most_cells:
            top = top[mass[top].argpartition(-settings.most_cells)[-settings.most_cells:]]
        top = top[np.argsort(-mass[top])]
        chosen = np.zeros(self._cells, bool)
        chosen[top] = True
        members = np.flatnonzero(chosen[cell])
        hypotheses, weight, cell = hypotheses.take(members), weight[members], cell[members]
        found: list[Place] = []
        free = np.ones(len(hypotheses), bool)
        for each in top[:settings.most_candidates]:
            if found and mass[each] < settings.least_candidate:
                break
            seed = free & (cell == each)
            if seed.any():
                near = self._gathered(hypotheses, weight, seed) & free
                near = near if near.any() else seed
                found.append(_summary(hypotheses, weight, near))
                free &= ~near
        return sorted(found, key=lambda place: -place.probability)

    def _gathered(
        self, hypotheses: Hypotheses, weight: Floats, near: NDArray[np.bool_],
    ) -> NDArray[np.bool_]:
        """Return the mask of the hypotheses around the mean of those in the mask ``near``."""
        settings, positions = self._settings, hypotheses.positions
        for _ in range(2):
            _, position, rotation = _mean(hypotheses, weight, near)
            apart = positions - position
            after = (apart.real ** 2 + apart.imag ** 2 <= settings.mode_m ** 2) & (
                np.abs(wrapped(hypotheses.rotation - rotation)) <= settings.mode_heading)
            if not after.any():
                break
            near = after
        return near


def _mean(
    hypotheses: Hypotheses, weight: Floats, near: NDArray[np.bool_],
) -> tuple[Floats, complex, float]:
    """Return the normalised weights of some hypotheses, their mean position and rotation."""
    weight, rotation = weight[near], hypotheses.rotation[near]
    total = float(weight.sum())
    share = weight / total if total > 0.0 else np.full(len(weight), 1.0 / len(weight))
    position = complex((share * hypotheses.positions[near]).sum())
    # Faster than the exponential of complex numbers.
    mean = math.atan2((share * np.sin(rotation)).sum(), (share * np.cos(rotation)).sum())
    return share, position, mean


def _summary(hypotheses: Hypotheses, weight: Floats, near: NDArray[np.bool_]) -> Place:
    """Return the place of the hypotheses in the mask ``near``."""
    share, position, rotation = _mean(hypotheses, weight, near)
    positions = hypotheses.positions[near]
    off = wrapped(hypotheses.rotation[near] - rotation)
    apart = np.stack([positions.real - position.real, positions.imag - position.imag, off])
    covariance = (share * apart) @ apart.T
    covariance[2, 2] += float((share * hypotheses.rotation_variance[near]).sum())
    log_scale = hypotheses.log_scale[near]
    mean_scale = float((share * log_scale).sum())
    return Place(
        position, rotation, float(weight[near].sum()), covariance, mean_scale,
        math.sqrt(float((share * (
            (log_scale - mean_scale) ** 2 + hypotheses.scale_variance[near])).sum())))
