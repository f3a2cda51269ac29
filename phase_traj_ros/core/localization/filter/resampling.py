# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Keeps the number of hypotheses in bounds: prunes, merges, resamples and splits them."""

import numpy as np
from phase_traj_ros.core.localization.filter.hypotheses import Hypotheses
from phase_traj_ros.core.localization.roads import Floats
from phase_traj_ros.core.localization.settings import LocatorSettings


def pruned(hypotheses: Hypotheses, settings: LocatorSettings) -> Hypotheses:
    """Return the hypotheses without those of negligible weight."""
    kept = hypotheses.log_weight >= hypotheses.log_weight.max() - settings.least_weight
    return hypotheses if kept.all() else hypotheses.take(np.flatnonzero(kept))


def merged(
    hypotheses: Hypotheses, settings: LocatorSettings, rng: np.random.Generator,
) -> Hypotheses:
    """
    Return the hypotheses with each group of similar ones replaced by one of their total weight.

    The one that remains is drawn by weight: the best one or the mean would shrink the spread.
    """
    key = hypotheses.piece * 4 + np.minimum(
        hypotheses.offset / settings.merge_m, 3).astype(np.int64)
    for values, width, bins in (
            (hypotheses.log_scale, settings.merge_scale, 512),
            (hypotheses.rotation, settings.merge_heading, 64)):
        key = key * bins + np.floor(values / width).astype(np.int64) % bins
    order = np.argsort(key)
    key = key[order]
    begins = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    if len(begins) == len(hypotheses):
        return hypotheses
    weight = np.exp(hypotheses.log_weight[order] - hypotheses.log_weight.max())
    total = np.add.reduceat(weight, begins)
    summed = np.cumsum(weight)
    before = summed[begins] - weight[begins]
    drawn = np.searchsorted(summed, before + rng.random(len(begins)) * total)
    ends = np.concatenate([begins[1:], [len(key)]]) - 1
    result = hypotheses.take(order[np.clip(drawn, begins, ends)])
    result.log_weight = np.log(np.maximum(total, 1e-300)) + hypotheses.log_weight.max()
    return result


def resampled(hypotheses: Hypotheses, most: int, rng: np.random.Generator) -> Hypotheses:
    """
    Return at most about ``most`` hypotheses: keep the heavy ones, and resample the others.

    P. Fearnhead and P. Clifford, "On-line inference for hidden Markov models via particle
    filters", 2003: the expected weights are unchanged, with the least variance of all such
    schemes.
    """
    if len(hypotheses) <= most:
        return hypotheses
    most_log = float(hypotheses.log_weight.max())
    weight = np.exp(hypotheses.log_weight - most_log)
    threshold = _threshold(weight, most)
    light = np.flatnonzero(weight < threshold)
    summed = np.cumsum(weight[light])
    count = round(float(summed[-1]) / threshold)
    at = (np.arange(count) + rng.random()) * (summed[-1] / max(count, 1))
    drawn = light[np.minimum(np.searchsorted(summed, at), len(light) - 1)]
    heavy = np.flatnonzero(weight >= threshold)
    result = hypotheses.take(np.concatenate([heavy, drawn]))
    result.log_weight[len(heavy):] = np.log(threshold) + most_log
    return result


def split(hypotheses: Hypotheses, fewest: int) -> Hypotheses:
    """
    Return about ``fewest`` hypotheses if there are fewer: copies of the heavy ones share a weight.

    The copies spread over positions and scales in the next strides. Copies of light hypotheses
    would leave too few for the true place while it does not lead yet.
    """
    count = len(hypotheses)
    if count >= fewest:
        return hypotheses
    weight = np.exp(hypotheses.log_weight - hypotheses.log_weight.max())
    ordered = np.sort(weight)[::-1]
    # The weight of each copy if the k heaviest are split into equal parts.
    parts = np.cumsum(ordered) / (fewest - count + 1 + np.arange(count))
    part = parts[np.flatnonzero(ordered >= parts)[-1]]
    copies = np.maximum(np.rint(weight / part), 1.0).astype(np.int64)
    result = hypotheses.take(np.repeat(np.arange(count), copies))
    result.log_weight -= np.repeat(np.log(copies), copies)
    return result


def _threshold(weight: Floats, most: int) -> float:
    """Return t such that the sum of min(weight / t, 1) is ``most``."""
    ordered = np.sort(weight)[::-1]
    rest = ordered.sum() - np.concatenate([[0.0], np.cumsum(ordered[:most - 1])])
    # The others share most - k copies if the k heaviest are kept.
    threshold = rest / (most - np.arange(most))
    kept = np.flatnonzero(ordered[:most] <= threshold)
    return float(threshold[kept[0] if len(kept) else -1])
