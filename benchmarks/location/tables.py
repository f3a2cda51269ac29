# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tables of the page on localisation."""

from __future__ import annotations

from collections.abc import Iterable
import math

from benchmarks.location.drives import HERE
from benchmarks.location.outcome import Row
from benchmarks.shared.report import table, verdict

# Limits: metres after which a drive is located, by drive and what is known of its camera; errors
# once located (median and 90 % in metres, heading in degrees), with a given height.
_LIMITS = {('00', 'given'): 800, ('02', 'given'): 700, ('08', 'given'): 1050,
           ('00', 'unknown'): 1200, ('02', 'unknown'): 1200}
_ERRORS = (3.0, 6.0, 1.0)


def outcomes(rows: list[Row]) -> str:
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


def counts(rows: list[Row]) -> str:
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
        'right of the steps with 0.95 to 0.99'), lines)


def _range(values: Iterable[float]) -> str:
    numbers = [round(value) for value in values]
    if not numbers:
        return ''
    least, most = min(numbers), max(numbers)
    return f'{least}' if least == most else f'{least} to {most}'


def _mean(values: Iterable[float | None]) -> str:
    numbers = [value for value in values if value is not None]
    return f'{sum(numbers) / len(numbers):.1f}' if numbers else ''
