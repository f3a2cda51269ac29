# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What comes of following a drive on a road map."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
import time

from benchmarks.location.drives import moved
import numpy as np
from phase_traj_ros.core import (
    LocatorSettings,
    MapLocator,
    OdometryStep,
    PositionFix,
    RoadMap,
    ScaleRange,
)

_WRONG_M = 50.0
# Sequences without a known place: the drive has to fit on the roads, within this.
_SHAPE_M = 10.0


@dataclass(frozen=True)
class Row:
    """What came of a drive; metres, degrees, shares."""

    name: str
    seed: int
    located: float | None
    claimed: float
    median: float | None = None
    most: float | None = None
    heading: float | None = None
    wrong: float | None = None
    likely: tuple[int, int] = (0, 0)
    """Steps told 0.95 to 0.99, and how many of them were right."""
    times: dict[str, float] = field(default_factory=dict)


def follow(
    name: str, steps: list[OdometryStep], roads: RoadMap, truth: np.ndarray | None,
    way: np.ndarray, *, seed: int = 0, scale: ScaleRange | None = None,
    settings: LocatorSettings | None = None, poses: np.ndarray | None = None,
    fixes: Mapping[int, PositionFix] | None = None,
) -> Row:
    """
    Follow a drive, and return what came of it.

    ``truth`` and ``way`` are (N + 1, 3) and (N + 1,) for N steps; without truth, the ``poses``
    of a drive that is on the map, (N + 1, 3), tell whether the claims are right. ``fixes`` are
    those that come just before a step, by its number.
    """
    locator = MapLocator(roads, scale=scale, settings=settings, seed=seed)
    found, spent = [], []
    for number, step in enumerate(steps):
        if fixes is not None and number in fixes:
            locator.fix(fixes[number])
        before = time.process_time()
        estimate = locator.update(step)
        spent.append(time.process_time() - before)
        found.append((
            estimate.x, estimate.y, estimate.heading, estimate.probability, estimate.claimed))
    table_of = np.array(found, float)
    claimed = table_of[:, 4] > 0
    spacing = np.diff(way)
    share = float(spacing[claimed].sum() / spacing.sum())
    if truth is None and poses is not None:
        truth = _fitted(table_of, claimed, poses, way, roads)
    likely = (table_of[:, 3] >= 0.95) & (table_of[:, 3] <= 0.99)
    row = Row(
        name, seed, float(way[1:][claimed.argmax()]) if claimed.any() else None, share,
        times=_times(np.array(spent), claimed, way))
    if truth is None:
        return replace(row, wrong=1.0 if claimed.any() else None)
    off = np.hypot(*(table_of[:, :2] - truth[1:, :2]).T)
    turned = np.abs(np.remainder(table_of[:, 2] - truth[1:, 2] + np.pi, 2 * np.pi) - np.pi)
    row = replace(row, likely=(
        int(likely.sum()), int((off[likely] <= _WRONG_M).sum())))
    if not claimed.any():
        return row
    return replace(
        row, median=float(np.median(off[claimed])), most=float(np.percentile(off[claimed], 90)),
        heading=float(np.degrees(np.median(turned[claimed]))),
        wrong=float(np.mean(off[claimed] > _WRONG_M)))


def _fitted(
    found: np.ndarray, claimed: np.ndarray, poses: np.ndarray, way: np.ndarray, roads: RoadMap,
) -> np.ndarray | None:
    """Return the poses moved from the claimed track onto the roads, or None if they do not fit."""
    used = np.flatnonzero(claimed)
    if not len(used):
        return None
    middle = used[len(used) // 2]
    turn = float(np.median(np.unwrap(found[used, 2] - poses[used + 1, 2])))
    result = moved(poses, turn, np.zeros(2))
    result[:, :2] += found[middle, :2] - result[middle + 1, :2]
    points = roads.middles @ np.array([1, 1j])
    for reach in np.repeat(np.arange(200.0, way[-1] + 200.0, 100.0), 3):
        near = np.flatnonzero(np.abs(way - way[middle]) <= reach)[::25]
        places = result[near, :2] @ np.array([1, 1j])
        there = points[[np.abs(points - place).argmin() for place in places]]
        off = places - places.mean()
        angle = float(np.angle(((there - there.mean()) * off.conj()).sum()))
        centre = np.array([places.mean().real, places.mean().imag])
        result[:, :2] -= centre
        result = moved(result, angle, np.array([there.mean().real, there.mean().imag]))
    apart = [roads.distance_to(x, y) for x, y in result[::25, :2]]
    return result if np.percentile(apart, 90) <= _SHAPE_M else None


def _times(spent: np.ndarray, claimed: np.ndarray, way: np.ndarray) -> dict[str, float]:
    """Return milliseconds per 5 m of way, located and before, and the worst step."""
    spacing, times = np.diff(way), {'worst': 1e3 * float(spent.max())}
    for name, which in (('located', claimed), ('searching', ~claimed)):
        metres = float(spacing[which].sum())
        if metres > 100.0:
            times[name] = 1e3 * float(spent[which].sum()) / metres * 5.0
    return times
