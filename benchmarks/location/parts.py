# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The parts of the localisation study: each follows drives of one kind."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product
import subprocess
import sys

from benchmarks.location.drives import (
    coded,
    ELSEWHERE,
    ELSEWHERE_MIRRORED,
    HERE,
    LARGE,
    large_map,
    LINK_M,
    MIRRORED,
    MISSING,
    noisy,
    on_map,
    OUT,
    own,
    PARTLY,
    SEQUENCES,
    stretch,
    town,
    true_poses,
    way_of,
    with_noise,
    with_straight,
    without_driven,
)
from benchmarks.location.outcome import follow, Row
from benchmarks.shared.report import ROOT
import numpy as np
from phase_traj_ros.core import LocatorSettings, PositionFix, ScaleRange

_OWN, _LEARNED, _OWN_SEEDS = ('00', '02', '08'), ('00',), 3
# What the height of a camera on a car may be, in metres.
_HEIGHTS = ScaleRange(1.1, 2.2)
# Metres of the parts of drives, and the drives without which it was chosen what may be claimed.
_PART_M = 1500
_HELD_OUT = ('02', '10')
# Drives with GPS: their noise and what is constant of their errors, in metres.
_GPS = ('00', '02')
_RECEIVERS = ((2.0, 0.0), (5.0, 0.0), (10.0, 0.0), (2.0, 8.0), (2.0, 15.0))
# Metres of a drive with turns, and of the straight way after them, that no road of the map is.
_FIRST_M, _STRAIGHT_M = 700.0, 3000.0


def with_own(seeds: int) -> Iterator[Row]:
    """Locate the drives with this package's own odometry, by several random numbers."""
    for name, kind in product((HERE, ELSEWHERE), ('given', 'unknown', 'learned')):
        for sequence in _OWN if kind != 'learned' else _LEARNED:
            recorded = f'{sequence}-learned' if kind == 'learned' else sequence
            file = OUT / 'odometry' / f'{recorded}.npz'
            if not file.exists():
                raise SystemExit(
                    f'{file} is missing: run benchmarks/location/odometry.py {file.parent}'
                    f' {recorded}')
            steps = own(file, metric=kind == 'given')
            truth = on_map(sequence) if name == HERE else None
            for seed in range(_OWN_SEEDS * seeds if name == HERE else seeds):
                yield follow(
                    f'{sequence}, {kind}, {name}', steps, town(name).roads, truth,
                    way_of(true_poses(sequence)), seed=seed,
                    scale=None if kind == 'given' else _HEIGHTS)


def noisily(seeds: int) -> Iterator[Row]:
    """Locate the true poses with noise."""
    yield from _noisy(HERE, SEQUENCES, seeds)


def falsely(seeds: int) -> Iterator[Row]:
    """Try to locate drives on maps where they are not."""
    for name in (ELSEWHERE, MIRRORED):
        yield from _noisy(name, SEQUENCES, seeds)
    for sequence in _OWN:
        truth = on_map(sequence)
        for seed in range(seeds):
            yield follow(
                f'{sequence}, {MISSING}', noisy(sequence, seed), without_driven(truth), truth,
                way_of(true_poses(sequence)), seed=seed)
    yield from _noisy(PARTLY, _OWN, seeds)
    for name, sequence in product((ELSEWHERE, MIRRORED), (*_OWN, '09')):
        poses = with_straight(true_poses(sequence)[:2000], _FIRST_M, _STRAIGHT_M)
        for seed in range(seeds):
            yield follow(
                f'{sequence}, {name}, 3 km straight', with_noise(
                    poses, np.random.default_rng((seed, int(sequence)))),
                town(name).roads, None, way_of(poses), seed=seed)


def many(seeds: int) -> Iterator[Row]:
    """Try to locate many parts of drives, on maps where they are and where they are not."""
    parts = [(sequence, float(start)) for sequence in ('00', '08', '09', '02', '10')
             for start in range(0, int(way_of(true_poses(sequence))[-1]) - 700, 1000)]
    both, forth, back_only = (False, True), (False,), (True,)
    # As many draws again on the wrong maps, last: a stopped run has some of each.
    for seed, (name, unknown, ways) in product(range(2 * seeds), (
            (MIRRORED, False, both), (MIRRORED, True, forth), (ELSEWHERE, False, both),
            (ELSEWHERE, True, back_only), (ELSEWHERE_MIRRORED, False, forth),
            (HERE, False, both), (HERE, True, forth))):
        for (number, (sequence, start)), back in product(enumerate(parts), ways):
            truth = on_map(sequence) if name == HERE else None
            if name == HERE and (truth is None or seed >= seeds):
                continue
            those = stretch(
                true_poses(sequence) if truth is None else truth, start, _PART_M, back=back)
            rng = np.random.default_rng((seed, number, back))
            steps = with_noise(those, rng)
            if unknown:
                height = rng.uniform(1.2, 2.0)
                steps = [replace(each, distance=each.distance / height) for each in steps]
            half = 'held out' if sequence in _HELD_OUT else 'looked at'
            yield follow(
                f'{name}, {"unknown" if unknown else "given"}, {half}', steps,
                town(name).roads, None if truth is None else those, way_of(those),
                seed=seed, scale=_HEIGHTS if unknown else None)


def worse(seeds: int) -> Iterator[Row]:
    """Locate drives with much more noise."""
    yield from _noisy(HERE, _OWN, seeds, heading=5.0)
    yield from _noisy(HERE, _OWN, seeds, drift=4.0)


def _noisy(
    name: str, sequences: tuple[str, ...], seeds: int, **factors: float,
) -> Iterator[Row]:
    told = ''.join(f', {key} ×{value:.0f}' for key, value in factors.items())
    for sequence in sequences:
        here = name in (HERE, PARTLY)
        for seed in range(seeds):
            yield follow(
                f'{sequence}, {name}{told}', noisy(sequence, seed, **factors), town(name).roads,
                on_map(sequence) if here else None, way_of(true_poses(sequence)), seed=seed,
                poses=true_poses(sequence) if here else None)


def with_gps(seeds: int) -> Iterator[Row]:
    """Locate the true poses with noise and a fix each second, on the right map and on others."""
    for sequence, (noise, bias) in product(_GPS, _RECEIVERS):
        told = f'{noise:.0f} m' + (f', {bias:.0f} m aside' if bias else '')
        truth = on_map(sequence)
        assert truth is not None
        for seed in range(seeds):
            yield follow(
                f'{sequence}, {told}', noisy(sequence, seed), town(HERE).roads, truth,
                way_of(true_poses(sequence)), seed=seed, fixes=_fixes(truth, noise, bias, seed))
    truth = on_map(_GPS[0])
    assert truth is not None
    for (noise, bias), roads in product(_RECEIVERS, (
            (MISSING, without_driven(truth)), (MIRRORED, town(MIRRORED).roads))):
        name, there = roads
        yield follow(
            f'{_GPS[0]}, {noise:.0f} m, {bias:.0f} m aside, {name}', noisy(_GPS[0], 0), there,
            truth, way_of(true_poses(_GPS[0])), fixes=_fixes(truth, noise, bias, 0))


def _fixes(truth: np.ndarray, noise: float, bias: float, seed: int) -> dict[int, PositionFix]:
    """Return a fix each second, its noise stated, and an error to the north-east that is not."""
    rng = np.random.default_rng(seed)
    off = rng.normal(0.0, noise, (len(truth), 2)) + bias * np.sqrt(0.5)
    x, y = (truth[:, :2] + off).T.tolist()
    return {number: PositionFix(x[number], y[number], noise ** 2, noise ** 2)
            for number in range(10, len(truth) - 1, 10)}


def from_codes(_: int) -> Iterator[Row]:
    """Locate bare codes of equal links."""
    for sequence in ('00', '02', '08', '09', '10'):
        steps, frames = coded(sequence)
        ends = [0, *frames]
        truth, poses = on_map(sequence), true_poses(sequence)
        yield follow(
            sequence, steps, town(HERE).roads, None if truth is None else truth[ends],
            way_of(poses)[ends], poses=poses[ends],
            settings=LocatorSettings.of_links(LINK_M * ScaleRange().middle))


def loading(_: int) -> Iterator[Row]:
    """Measure time and memory of reading the maps, each in a process of its own."""
    large_map()
    for name in (HERE, ELSEWHERE, LARGE):
        script = (
            'import time, resource; from benchmarks.location.drives import town;'
            'before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss;'
            f'start = time.process_time(); town({name!r});'
            'print(time.process_time() - start,'
            ' (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024)')
        told = subprocess.run(
            [sys.executable, '-c', script], cwd=ROOT, check=True, capture_output=True, text=True)
        seconds, megabytes = map(float, told.stdout.split())
        yield Row(name, 0, None, 0.0, times={'s': seconds, 'MB': megabytes})


def on_large(seeds: int) -> Iterator[Row]:
    """Locate drives on a large map."""
    for sequence in _OWN:
        for seed in range(seeds):
            yield follow(
                f'{sequence}, {LARGE}', noisy(sequence, seed), town(LARGE).roads,
                on_map(sequence, LARGE), way_of(true_poses(sequence)), seed=seed)


PARTS: dict[str, Callable[[int], Iterator[Row]]] = {
    'own': with_own, 'noise': noisily, 'false': falsely, 'worse': worse, 'many': many,
    'gps': with_gps, 'codes': from_codes, 'large': on_large, 'loading': loading}
