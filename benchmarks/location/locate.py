# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
How soon and how well drives are located on a road map, and how often wrongly.

Takes about an hour and writes docs/measurements/locate.md. The results of each part are kept in
out/locate, so a stopped run continues where it was. ``--part NAME`` measures one part, ``--page``
writes the page from the available results, ``--seeds N`` draws N times the noise. The part ``own``
needs the odometry that benchmarks/location/odometry.py records into out/locate/odometry.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field, replace
from itertools import product
import json
import math
import subprocess
import sys
import time

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
    moved,
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
    without_driven,
)
from benchmarks.shared.report import disturbance, machine, paragraphs, ROOT, table, verdict
from benchmarks.shared.timing import bystanders, prepare
import numpy as np
from phase_traj_ros.core import (
    LocatorSettings,
    MapLocator,
    OdometryStep,
    RoadMap,
    ScaleRange,
)

_DOCUMENT = ROOT / 'docs' / 'measurements' / 'locate.md'
_KEPT = OUT
_OWN, _LEARNED, _OWN_SEEDS = ('00', '02', '08'), ('00',), 3
# What the height of a camera on a car may be, in metres.
_HEIGHTS = ScaleRange(1.1, 2.2)
_WRONG_M = 50.0
# Sequences without a known place: the drive has to fit on the roads, within this.
_SHAPE_M = 10.0
# Metres of the parts of drives, and the drives without which it was chosen what may be claimed.
_PART_M = 1500
_HELD_OUT = ('02', '10')
# Limits: metres after which a drive is located, by drive and what is known of its camera; errors
# once located (median and 90 % in metres, heading in degrees), with a given height.
_LIMITS = {('00', 'given'): 800, ('02', 'given'): 700, ('08', 'given'): 1050,
           ('00', 'unknown'): 1200, ('02', 'unknown'): 1200}
_ERRORS = (3.0, 6.0, 1.0)

_INTRODUCTION = """
    This page shows how soon a drive is [located](../how-to/locate.md) on a road map without
    any prior, how exact the place then is, and how often a place is claimed that is wrong.
    Drives of several kilometres through a town are located after 0.5 to 1 km, whether the height
    of the camera is known or not, and drives of a kilometre often not at all. From then on the
    place is a few metres off along the road. The tuning was chosen on some of these drives, so
    their figures are not those of new drives. The way varies with the random numbers, by a
    hundred metres and more.

    The map is an extract of Karlsruhe of about 22 km² with 255 km of road. *Located* is the way
    until a place is claimed, *claimed* the share of the whole way on which one is. The errors
    are those while one is claimed; *wrong* is the share of claimed steps more than 50 m off. A
    drive that is not in a table was not measured in this run.
    """
_OWN_TEXT = """
    The odometry of this package along rendered KITTI sequences, the calibration of the camera
    given, its height given (but 4 % wrong, as drawn) or unknown (1.1 to 2.2 m); *learned* is an
    unknown height and a camera that was learned from the turns of the drive. On Karlsruhe each is
    located with three seeds of the random numbers: the way is the range of the three, the errors
    are their means. The limits are 800, 700 and 1,050 m with a given height, and then 3 m in the
    median, 6 m at 90 % and 1°; with an unknown one 1,200 m for 00 and 02. Each seed has to reach
    that of the way.
    """
_NOISE_TEXT = """
    The true poses of KITTI sequences with drawn noise: the heading 0.4° per root of 100 m and
    0.02° per frame, the scale 5 % and 1.5 % per root of 100 m. Sequence 04 is straight and 06
    a symmetric loop: these have to stay unclaimed, and the five others should be located. Where
    nobody measured the place of a sequence, the whole drive, moved to the claimed place and
    fitted to the roads around it, has to lie on roads: nine tenths of it within 10 m. The errors
    are those from there.
    """
_FALSE_TEXT = """
    The same drives on maps where they are not, on the right map without the ways that come
    within 60 m of the drive, or where every tenth road is missing. On the latter a claim may be
    right, and only steps more than 50 m off count.
    """
_WORSE_TEXT = """
    The noise of the heading five times larger, or the drift of the distance four times. All
    should be located.
    """
_EVIDENCE_TEXT = """
    Parts of 1.5 km of the drives 00, 02, 08, 09 and 10, in both directions, with other noise for
    each: on the maps of another town and of mirrored towns nothing may be claimed, and on the map
    of Karlsruhe nothing that is more than 50 m off. A rotated map would not be another one: the
    drive begins in any direction. When it was chosen what may be claimed, the runs on wrong maps
    of the drives *held out*, 02 and 10, played no part; their runs on the right map were seen.
    *Unknown* is a scale of 1.1 to 2.2 m per unit.
    """
_LARGE_TEXT = """
    True poses with noise as above, on one map of 110 km² with 1,020 km of road: Karlsruhe,
    Kaiserslautern, and the mirror images of both.
    """
_CODES_TEXT = """
    From the bare code of equal links alone, as `locate` reads it: links of 10 m in eight
    directions, three bits per 10 m. That the drive is on the map is assumed: so coarse a drive
    cannot prove it. More of the claimed steps are wrong than with an odometry.
    """


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


def main() -> None:
    """Measure the parts that are missing, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--part', choices=PARTS)
    parser.add_argument('--page', action='store_true')
    parser.add_argument('--seeds', type=int, default=1)
    arguments = parser.parse_args()
    _KEPT.mkdir(parents=True, exist_ok=True)
    prepare()
    for part in [arguments.part] if arguments.part else [] if arguments.page else PARTS:
        if arguments.part or not _file(part).exists():
            with bystanders() as watched:
                rows = []
                for row in PARTS[part](arguments.seeds):
                    rows.append(asdict(row))
                    print(row, flush=True)
                    _file(part).write_text(json.dumps({'rows': rows}))
            _file(part).write_text(json.dumps(
                {'rows': rows, 'watched': disturbance(watched)}))
    if not arguments.part:
        _DOCUMENT.write_text('\n\n'.join(page()) + '\n')


def _file(part: str):
    return _KEPT / f'{part}.json'


def follow(
    name: str, steps: list[OdometryStep], roads: RoadMap, truth: np.ndarray | None,
    way: np.ndarray, *, seed: int = 0, scale: ScaleRange | None = None,
    settings: LocatorSettings | None = None, poses: np.ndarray | None = None,
) -> Row:
    """
    Follow a drive, and return what came of it.

    ``truth`` and ``way`` are (N + 1, 3) and (N + 1,) for N steps; without truth, the ``poses``
    of a drive that is on the map, (N + 1, 3), tell whether the claims are right.
    """
    locator = MapLocator(roads, scale=scale, settings=settings, seed=seed)
    found, spent = [], []
    for step in steps:
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


def with_own(seeds: int) -> Iterator[Row]:
    """Locate the drives with this package's own odometry, by several random numbers."""
    for name, kind in product((HERE, ELSEWHERE), ('given', 'unknown', 'learned')):
        for sequence in _OWN if kind != 'learned' else _LEARNED:
            recorded = f'{sequence}-learned' if kind == 'learned' else sequence
            file = _KEPT / 'odometry' / f'{recorded}.npz'
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
    'codes': from_codes, 'large': on_large, 'loading': loading}


def page() -> Iterator[str]:
    """Yield the blocks of the page from the results that are available."""
    yield '# Where on the map'
    yield paragraphs(_INTRODUCTION)
    yield 'Written by `benchmarks/location/locate.py`.'
    for part, title, text in (
            ('own', 'Odometry of this package', _OWN_TEXT),
            ('noise', 'True poses with noise', _NOISE_TEXT),
            ('false', 'Where nothing may be claimed', _FALSE_TEXT),
            ('worse', 'More noise', _WORSE_TEXT), ('large', 'A large map', _LARGE_TEXT),
            ('codes', 'Bare codes', _CODES_TEXT)):
        rows = _rows(part)
        if rows:
            yield f'## {title}'
            yield paragraphs(text)
            yield _table(rows)
    if _rows('many'):
        yield '## Many drives'
        yield paragraphs(_EVIDENCE_TEXT)
        yield _counts(_rows('many'))
        yield paragraphs(_elsewhere())
    yield '## Calibration and cost'
    yield paragraphs(_calibration())
    yield machine()


def _rows(part: str) -> list[Row]:
    if not _file(part).exists():
        return []
    kept = json.loads(_file(part).read_text())['rows']
    return [Row(**{**row, 'likely': tuple(row['likely'])}) for row in kept]


def _table(rows: list[Row]) -> str:
    """Return a table of rows, those of one drive and different noise in one."""
    lines = []
    for name in dict.fromkeys(row.name for row in rows):
        those = [row for row in rows if row.name == name]
        located = [row for row in those if row.located is not None]
        lines.append((
            name, f'{len(located)} of {len(those)}', _range(row.located for row in located),
            _range(100 * row.claimed for row in located), _mean(row.median for row in located),
            _mean(row.most for row in located), _mean(row.heading for row in located),
            _mean(100 * row.wrong for row in located if row.wrong is not None), _reached(those)))
    return table((
        'drive, map', 'located', 'after (m)', 'claimed (%)', 'median (m)', '90 % (m)',
        'heading (°)', 'wrong (%)', 'within the limits'), lines)


def _reached(rows: list[Row]) -> str:
    """Return the verdict on the rows of a drive with this package's odometry."""
    parts = rows[0].name.split(', ')
    limit = _LIMITS.get(tuple(parts[:2])) if parts[2:] == [HERE] else None
    shares = [] if limit is None else [(row.located or math.inf) / limit for row in rows]
    if limit is not None and parts[1] == 'given':
        errors = [(row.median, row.most, row.heading) for row in rows if row.located]
        shares += [sum(those) / len(those) / most for those, most in zip(zip(*errors), _ERRORS)]
    return verdict(max(shares, default=0.0), 1.0 if shares else None)


def _counts(rows: list[Row]) -> str:
    """Return a table of the number of claims, right and wrong, and a line of all."""
    lines = []
    for name in (*dict.fromkeys(row.name for row in rows), 'all'):
        those = [row for row in rows if name in (row.name, 'all')]
        told = sum(row.likely[0] for row in those)
        lines.append((
            name, len(those), sum(row.located is not None for row in those),
            _range(row.located for row in those if row.located is not None),
            sum(bool(row.wrong) for row in those),
            f'{sum(row.likely[1] for row in those)} of {told}' if told else ''))
    return table((
        'map, scale, parts', 'runs', 'located', 'after (m)', 'with a wrong claim',
        'right of the steps told 0.95 to 0.99'), lines)


def _elsewhere() -> str:
    """Return how often a place was claimed where none may be, in all parts of the study."""
    rows = [
        row for part in ('own', 'false', 'many') for row in _rows(part)
        if any(name in row.name for name in (ELSEWHERE, MIRRORED, MISSING))]
    claimed = sum(row.located is not None for row in rows)
    text = (f'In all parts of this page, {len(rows)} runs are on a map where the drive is not, and'
            f' a place was claimed in {claimed}. At most one of 200 may have one.')
    return text if len(rows) >= 200 else f'{text} So few runs cannot show that.'


def _range(values) -> str:
    numbers = [round(value) for value in values]
    if not numbers:
        return ''
    least, most = min(numbers), max(numbers)
    return f'{least}' if least == most else f'{least} to {most}'


def _mean(values) -> str:
    numbers = [value for value in values if value is not None]
    return f'{sum(numbers) / len(numbers):.1f}' if numbers else ''


def _calibration() -> str:
    rows = [row for part in ('own', 'noise', 'worse', 'large') for row in _rows(part)]
    told = sum(row.likely[0] for row in rows)
    right = sum(row.likely[1] for row in rows)
    blocks = []
    if told:
        blocks.append(
            f'Of {told} steps that were told a probability of 0.95 to 0.99, {right / told:.1%}'
            ' were within 50 m of the truth.')
    for part, where in (('own', 'on the map of Karlsruhe'), ('large', 'on that of 110 km²')):
        for key, text in (('located', 'once located'), ('searching', 'before')):
            times = [
                row.times[key] for row in _rows(part)
                if key in row.times and not row.name.endswith(ELSEWHERE)]
            if times:
                blocks.append(
                    f'{text.capitalize()}, the filter takes {np.median(times):.1f} ms per 5 m'
                    f' {where} (median of the drives; at most {max(times):.1f} ms).')
    if blocks:
        blocks.append('The limits are 1.2 ms once located, and 60 ms before on 22 km².')
    blocks += [
        f'The map of {row.name} is read in {row.times["s"]:.1f} s and'
        f' {row.times["MB"]:.0f} MB.' for row in _rows('loading')]
    if _rows('loading'):
        blocks.append('The limits are 1 s for 22 km², and 3 s and 400 MB for 110 km².')
    return ' '.join(blocks)


if __name__ == '__main__':
    main()
