# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The places where hypotheses gather: when the best one counts as known, and when as left."""

from collections import deque
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.localization.hypotheses import carried, Hypotheses, wrapped
from phase_traj_ros.core.localization.roads import Floats, RoadMap
from phase_traj_ros.core.localization.settings import LocatorSettings


@dataclass(frozen=True, slots=True)
class Place:
    """
    A place, and what its hypotheses say.

    middle
        Mean place, as a complex number in metres.
    turned
        Mean rotation from the axes of the odometry to those of the map, in radians.
    probability
        Share of the total weight.
    covariance
        Covariance of x, y and the rotation, (3, 3).
    log_scale, scale_deviation
        Mean and standard deviation of the logarithm of the metres per unit of the odometry.
    """

    middle: complex
    turned: float
    probability: float
    covariance: Floats
    log_scale: float
    scale_deviation: float

    def carried(self, by: complex) -> complex:
        """Return where a displacement of the odometry leads from here."""
        return complex(carried(self.middle, by, self.log_scale, self.turned))


class Places:
    """Finds the places of most probability."""

    def __init__(self, roads: RoadMap, settings: LocatorSettings) -> None:
        """Sort the pieces of a map into cells."""
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
        Return the places of most probability, the best first, but at least one.

        ``log_total`` is the logarithm of the total weight, with that of the null hypothesis.
        """
        settings = self._settings
        weight = np.exp(hypotheses.log_weight - log_total)
        cell = self._cell[hypotheses.piece]
        mass = np.bincount(cell, weight, self._cells)
        # Once the place is known, few of the cells have any hypothesis.
        top = np.flatnonzero(np.bincount(cell))
        if len(top) > settings.most_cells:
            top = top[mass[top].argpartition(-settings.most_cells)[-settings.most_cells:]]
        top = top[np.argsort(-mass[top])]
        chosen = np.zeros(self._cells, bool)
        chosen[top] = True
        members = np.flatnonzero(chosen[cell])
        those, weight, cell = hypotheses.take(members), weight[members], cell[members]
        found: list[Place] = []
        free = np.ones(len(those), bool)
        for each in top[:settings.most_candidates]:
            if found and mass[each] < settings.least_candidate:
                break
            seed = free & (cell == each)
            if seed.any():
                near = self._gathered(those, weight, seed) & free
                near = near if near.any() else seed
                found.append(_summary(those, weight, near))
                free &= ~near
        return sorted(found, key=lambda place: -place.probability)

    def _gathered(
        self, those: Hypotheses, weight: Floats, near: NDArray[np.bool_],
    ) -> NDArray[np.bool_]:
        """Return which hypotheses are at the place around some of hypotheses."""
        settings, places = self._settings, those.places
        for _ in range(2):
            _, middle, mean = _mean(those, weight, near)
            apart = places - middle
            after = (apart.real ** 2 + apart.imag ** 2 <= settings.mode_m ** 2) & (
                np.abs(wrapped(those.turned - mean)) <= settings.mode_heading)
            if not after.any():
                break
            near = after
        return near


def _mean(
    those: Hypotheses, weight: Floats, near: NDArray[np.bool_],
) -> tuple[Floats, complex, float]:
    """Return the shares of some hypotheses in their weight, mean place and mean rotation."""
    weight, turned = weight[near], those.turned[near]
    total = float(weight.sum())
    share = weight / total if total > 0.0 else np.full(len(weight), 1.0 / len(weight))
    middle = complex((share * those.places[near]).sum())
    # Faster than the exponential of complex numbers.
    mean = math.atan2((share * np.sin(turned)).sum(), (share * np.cos(turned)).sum())
    return share, middle, mean


def _summary(those: Hypotheses, weight: Floats, near: NDArray[np.bool_]) -> Place:
    share, middle, mean = _mean(those, weight, near)
    places = those.places[near]
    off = wrapped(those.turned[near] - mean)
    apart = np.stack([places.real - middle.real, places.imag - middle.imag, off])
    covariance = (share * apart) @ apart.T
    covariance[2, 2] += float((share * those.variance[near]).sum())
    log_scale = those.log_scale[near]
    mean_scale = float((share * log_scale).sum())
    return Place(
        middle, mean, float(weight[near].sum()), covariance, mean_scale,
        math.sqrt(float((share * (
            (log_scale - mean_scale) ** 2 + those.scale_variance[near])).sum())))


class Claim:
    """Claims a place that has been probable for a while; drops it when it is improbable."""

    def __init__(self, settings: LocatorSettings, *, on_map: bool = False) -> None:
        """Claim nothing; ``on_map`` says that the vehicle is on the map, turned or not."""
        self._settings = settings
        self._on_map = on_map
        self.drop()

    def drop(self) -> None:
        """Claim nothing from now on."""
        self.leads = False
        """Whether a place has been probable for long enough."""
        self.held = False
        """Whether it is claimed."""
        self._sure_m = 0.0
        self._last: complex | None = None

    def prove(self) -> None:
        """Claim the place that leads: something else than the way has proven it."""
        self._on_map = True
        self.held = self.leads

    def follow(self, place: Place, metres: float, *, turned: float) -> None:
        """
        Take the best place after a way of so many metres.

        ``turned`` is the angle turned since the start, left and right. A place that jumps is
        another one.
        """
        settings = self._settings
        jumped = self._last is not None and (
            abs(place.middle - self._last) > settings.mode_m + 2 * metres)
        if jumped or place.probability < settings.drop_below:
            self.drop()
        if self.leads or place.probability > settings.claim_above:
            self._sure_m += metres if self._last is not None else 0.0
            self._last = place.middle
        else:
            self.drop()
        self.leads = self.leads or self._sure_m >= settings.claim_after_m
        self.held = self.leads and (self._on_map or turned >= settings.claim_turned)


class Astray:
    """
    Notices when the vehicle leaves the roads of the map.

    While a place leads, the evidence is that its roads bend as the odometry does. When it
    falls too much within a short way, the vehicle has been off the roads since before.
    """

    def __init__(self, settings: LocatorSettings) -> None:
        """Start on the roads."""
        self._settings = settings
        self._past: deque[tuple[float, float]] = deque()

    def forget(self) -> None:
        """Start again: what was known is not true any more."""
        self._past.clear()

    def follow(self, way: float, evidence: float) -> bool:
        """
        Take the evidence for a place that leads; return whether the roads have just been left.

        Parameters
        ----------
        way
            Metres travelled so far.
        evidence
            Logarithm of the likelihood so far of the odometry on the roads of the map, relative to
            that on a road that fits.

        """
        self._past.append((way, evidence))
        while way - self._past[0][0] > self._settings.lost_within_m:
            self._past.popleft()
        if max(before for _, before in self._past) - evidence < self._settings.lost_nats:
            return False
        self._past.clear()
        return True
