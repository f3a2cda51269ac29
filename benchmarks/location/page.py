# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The page on localisation, from the results that are available."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from benchmarks.location.drives import ELSEWHERE, MIRRORED, MISSING
from benchmarks.location.outcome import Row
from benchmarks.location.tables import counts, outcomes
from benchmarks.shared.report import machine, paragraphs
import numpy as np

_INTRODUCTION = """
    This page shows how soon a drive is [located](../how-to/locate.md) on a road map without any
    prior, how exact the place then is, and how often a place is claimed that is wrong. Drives of
    several kilometres through a town are mostly located after 0.5 to 1 km, whether the height of
    the camera is known or not, and some drives of one or two kilometres are not located at all.
    From then on the place is a few metres off along the road. The tuning was chosen on some of
    these drives, so their figures are not those of new drives. The way varies with the random
    numbers, by a hundred metres and more.

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
    0.02° per frame, the scale 5 % and 1.5 % per root of 100 m. The odometry states the
    variances of both drifts. Sequence 04 is straight and 06 a symmetric loop: these have to stay
    unclaimed, and the five others should be located. Where nobody measured the place of a
    sequence, the whole drive, moved to the claimed place and fitted to the roads around it, has
    to lie on roads: nine tenths of it within 10 m. The errors are those from there.
    """
_FALSE_TEXT = """
    The same drives on maps where they are not, on the right map without the ways that come
    within 60 m of the drive, or where every tenth road is missing. On the latter a claim may be
    right, and only steps more than 50 m off count. The last rows have 3 km straight on after
    700 m: a straight fits many roads of any map, and must not prove that the vehicle is on one.
    """
_WORSE_TEXT = """
    The noise of the heading five times larger, or the drift of the distance four times, as the
    odometry states. All should be located.
    """
_EVIDENCE_TEXT = """
    Parts of 1.5 km of the drives 00, 02, 08, 09 and 10, in both directions, with other noise for
    each: on the maps of another town and of mirrored towns nothing may be claimed, and on the map
    of Karlsruhe nothing that is more than 50 m off. A rotated map is not a different map, since a
    drive may begin in any direction. The rules for a claim were chosen without the runs of 02 and
    10 (*held out*) on wrong maps; their runs on the right map were seen. How the hypotheses are
    split, how often lost vehicles return and the penalty of the null hypothesis were chosen by 09
    and 10 on the right map, by three parts of 00 and 08 on the mirrored one, and by a made-up
    town. *Unknown* is a scale of 1.1 to 2.2 m per unit.
    """
_LARGE_TEXT = """
    True poses with noise as above, on one map of 110 km² with 1,020 km of road: Karlsruhe,
    Kaiserslautern, and the mirror images of both.
    """
_GPS_TEXT = """
    True poses with noise as above and a fix each second, with noise of 2, 5 or 10 m, which it
    states. *Aside* is a constant error to the north-east that it does not state: up to about 8 m,
    the road is still that of the fixes. With 15 m nothing should be claimed. The last rows have
    the same on maps without the roads that were driven, or of a mirrored town.
    """
_CODES_TEXT = """
    From the bare code of equal links alone, as `locate` reads it: links of 10 m in eight
    directions, three bits per 10 m. That the drive is on the map is assumed: so coarse a drive
    cannot prove it. More of the claimed steps are wrong than with an odometry.
    """


def page(rows_of: Callable[[str], list[Row]]) -> Iterator[str]:
    """Yield the blocks of the page from the rows of each part, which may be none."""
    yield '# Where on the map'
    yield paragraphs(_INTRODUCTION)
    yield 'Written by `benchmarks/location/locate.py`.'
    for part, title, text in (
            ('own', 'Odometry of this package', _OWN_TEXT),
            ('noise', 'True poses with noise', _NOISE_TEXT),
            ('false', 'Where nothing may be claimed', _FALSE_TEXT),
            ('worse', 'More noise', _WORSE_TEXT), ('large', 'A large map', _LARGE_TEXT),
            ('gps', 'With GPS', _GPS_TEXT), ('codes', 'Bare codes', _CODES_TEXT)):
        rows = rows_of(part)
        if rows:
            yield f'## {title}'
            yield paragraphs(text)
            yield outcomes(rows)
    if rows_of('many'):
        yield '## Many drives'
        yield paragraphs(_EVIDENCE_TEXT)
        yield counts(rows_of('many'))
        yield paragraphs(_elsewhere(rows_of))
    yield '## Calibration and cost'
    yield paragraphs(_calibration(rows_of))
    yield machine()


def _elsewhere(rows_of: Callable[[str], list[Row]]) -> str:
    """Return how often a place was claimed where none may be, in all parts of the study."""
    rows = [
        row for part in ('own', 'false', 'many') for row in rows_of(part)
        if any(name in row.name for name in (ELSEWHERE, MIRRORED, MISSING))]
    claimed = sum(row.located is not None for row in rows)
    text = (f'In all parts of this page, {len(rows)} runs are on a map where the drive is not, and'
            f' a place was claimed in {claimed}. At most one of 200 may have one.')
    return text if len(rows) >= 200 else f'{text} So few runs cannot show that.'


def _calibration(rows_of: Callable[[str], list[Row]]) -> str:
    rows = [row for part in ('own', 'noise', 'worse', 'large') for row in rows_of(part)]
    told = sum(row.likely[0] for row in rows)
    right = sum(row.likely[1] for row in rows)
    blocks = []
    if told:
        blocks.append(
            f'Of {told} steps with a stated probability of 0.95 to 0.99, {right / told:.1%}'
            ' were within 50 m of the truth.')
    for part, where in (('own', 'on the map of Karlsruhe'), ('large', 'on that of 110 km²')):
        for key, text in (('located', 'once located'), ('searching', 'before')):
            times = [
                row.times[key] for row in rows_of(part)
                if key in row.times and not row.name.endswith(ELSEWHERE)]
            if times:
                blocks.append(
                    f'{text.capitalize()}, the filter takes {np.median(times):.1f} ms per 5 m'
                    f' {where} (median of the drives; at most {max(times):.1f} ms).')
    if blocks:
        blocks.append('The limits are 1.2 ms once located, and 60 ms before on 22 km².')
    blocks += [
        f'The map of {row.name} is read in {row.times["s"]:.1f} s and'
        f' {row.times["MB"]:.0f} MB.' for row in rows_of('loading')]
    if rows_of('loading'):
        blocks.append('The limits are 1 s for 22 km², and 3 s and 400 MB for 110 km².')
    return ' '.join(blocks)
