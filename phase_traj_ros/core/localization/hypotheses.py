# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Hypotheses about the place of the vehicle, and how their number is kept in bounds."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.localization.roads import Complexes, Floats, Ints
from phase_traj_ros.core.localization.settings import LocatorSettings


@dataclass(slots=True, eq=False)
class Hypotheses:
    """
    Hypotheses as arrays, an entry for each.

    piece, offset
        The directed piece of road, and the metres from its start.
    log_scale, scale_variance
        Natural logarithm of the metres per unit of the odometry, and its variance, given the way
        so far.
    known_variance
        The variance at the last turn; infinite before the first one.
    turned, variance
        Rotation from the axes of the odometry to those of the map, in radians, and its variance.
    trail
        The last places, (5, N), the oldest first, as complex numbers in metres.
    log_weight
        Natural logarithm of the weight, not normalised.
    """

    piece: Ints
    offset: Floats
    log_scale: Floats
    scale_variance: Floats
    known_variance: Floats
    turned: Floats
    variance: Floats
    trail: Complexes
    log_weight: Floats

    def __len__(self) -> int:
        """Return the number of hypotheses."""
        return len(self.piece)

    def take(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> 'Hypotheses':
        """Return those with the given indices, or where the mask is true."""
        if chosen.dtype == np.bool_:
            chosen = np.flatnonzero(chosen)
        return Hypotheses(*(
            getattr(self, each.name).take(chosen, axis=-1) for each in fields(self)))

    def joined(self, *others: 'Hypotheses') -> 'Hypotheses':
        """Return these and others."""
        return Hypotheses(*(
            np.concatenate([getattr(them, each.name) for them in (self, *others)], axis=-1)
            for each in fields(self)))

    @property
    def places(self) -> Complexes:
        """Return the places, (N,), as complex numbers in metres."""
        places: Complexes = self.trail[-1]
        return places

    @property
    def log_total(self) -> float:
        """Return the logarithm of the sum of all weights; -inf if there are none."""
        if not len(self):
            return -np.inf
        most = float(self.log_weight.max())
        return most + float(np.log(np.exp(self.log_weight - most).sum()))

    def carried(self, by: complex) -> Complexes:
        """Return where a displacement of the odometry leads from the places."""
        places: Complexes = carried(self.places, by, self.log_scale, self.turned)
        return places


def carried(place: Any, by: Any, log_scale: Any, turned: Any) -> Any:
    """
    Return where a displacement of the odometry leads from a place, or from arrays of them.

    Places are complex numbers in metres, displacements in the axes and the unit of the odometry;
    the scale and the rotation are those of a hypothesis.
    """
    return place + by * np.exp(log_scale + 1j * turned)


def wrapped(angle: Floats) -> Floats:
    """Return angles within half a circle, in radians."""
    # Several times faster than the remainder.
    result: Floats = angle - 2 * np.pi * np.rint(angle / (2 * np.pi))
    return result


def pruned(them: Hypotheses, settings: LocatorSettings) -> Hypotheses:
    """Return the hypotheses without those of little weight."""
    if not len(them):
        return them
    kept = them.log_weight >= them.log_weight.max() - settings.least_weight
    return them if kept.all() else them.take(kept)


def merged(
    them: Hypotheses, settings: LocatorSettings, rng: np.random.Generator,
) -> Hypotheses:
    """
    Return the hypotheses with those that are alike made one, with the sum of their weights.

    The one that stays is drawn by weight: the best one or the mean would shrink the spread.
    """
    if len(them) < 2:
        return them
    key = them.piece * 4 + np.minimum(them.offset / settings.merge_m, 3).astype(np.int64)
    for values, width, bins in (
            (them.log_scale, settings.merge_scale, 512),
            (them.turned, settings.merge_heading, 64)):
        key = key * bins + np.floor(values / width).astype(np.int64) % bins
    order = np.argsort(key)
    key = key[order]
    begins = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    if len(begins) == len(them):
        return them
    weight = np.exp(them.log_weight[order] - them.log_weight.max())
    total = np.add.reduceat(weight, begins)
    summed = np.cumsum(weight)
    before = summed[begins] - weight[begins]
    drawn = np.searchsorted(summed, before + rng.random(len(begins)) * total)
    ends = np.concatenate([begins[1:], [len(key)]]) - 1
    result = them.take(order[np.clip(drawn, begins, ends)])
    result.log_weight = np.log(np.maximum(total, 1e-300)) + them.log_weight.max()
    return result


def resampled(them: Hypotheses, most: int, rng: np.random.Generator) -> Hypotheses:
    """
    Return at most ``most`` of the hypotheses: the heavy ones as they are, a draw of the others.

    P. Fearnhead and P. Clifford, "On-line inference for hidden Markov models via particle
    filters", 2003: the expected weights stay, and among such draws the error is the least.
    """
    if len(them) <= most:
        return them
    most_log = float(them.log_weight.max())
    weight = np.exp(them.log_weight - most_log)
    threshold = _threshold(weight, most)
    light = np.flatnonzero(weight < threshold)
    summed = np.cumsum(weight[light])
    count = round(float(summed[-1]) / threshold)
    at = (np.arange(count) + rng.random()) * (summed[-1] / max(count, 1))
    drawn = light[np.minimum(np.searchsorted(summed, at), len(light) - 1)]
    heavy = np.flatnonzero(weight >= threshold)
    result = them.take(np.concatenate([heavy, drawn]))
    result.log_weight[len(heavy):] = np.log(threshold) + most_log
    return result


def split(them: Hypotheses, fewest: int) -> Hypotheses:
    """
    Return about ``fewest`` hypotheses, if there are less: the heavy ones as several equal ones.

    Those that are split find different places and scales in what follows. The light ones would
    waste the copies, so that too few would stand for a right place that is not the best one yet.
    """
    count = len(them)
    if not 0 < count < fewest:
        return them
    weight = np.exp(them.log_weight - them.log_weight.max())
    ordered = np.sort(weight)[::-1]
    # With the k heaviest split into parts of one weight, the others stay as they are.
    parts = np.cumsum(ordered) / (fewest - count + 1 + np.arange(count))
    part = parts[np.flatnonzero(ordered >= parts)[-1]]
    copies = np.maximum(np.rint(weight / part), 1.0).astype(np.int64)
    result = them.take(np.repeat(np.arange(count), copies))
    result.log_weight -= np.repeat(np.log(copies), copies)
    return result


def _threshold(weight: Floats, most: int) -> float:
    """Return t such that the sum of min(weight / t, 1) is ``most``."""
    ordered = np.sort(weight)[::-1]
    rest = ordered.sum() - np.concatenate([[0.0], np.cumsum(ordered[:most - 1])])
    # With the k heaviest kept, the others share most - k places.
    threshold = rest / (most - np.arange(most))
    kept = np.flatnonzero(ordered[:most] <= threshold)
    return float(threshold[kept[0] if len(kept) else -1])
