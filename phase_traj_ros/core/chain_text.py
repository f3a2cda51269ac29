# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The chain code as one line that a person can read, and its parser.

Grammar (a space stands for exactly one)::

    text    = "frames " n "; movement " series "; direction " series
    series  = n " (0:" n " 1:" n " 2:" n " 3:" n ")" [" ..."] *(" " code "x" n)
    code    = "0" | "1" | "2" | "3"
    n       = a decimal number without sign

The first number of a series is its length, the brackets hold how often each code occurred, and
the runs follow, oldest first; ``...`` says that older runs are left out. For example::

    frames 34; movement 33 (0:0 1:25 2:1 3:7) 1x23 2x1 3x7 1x2; direction 26 (...) 1x23 2x3
"""

from dataclasses import dataclass
import re

from phase_traj_ros.core.chain_code import ChainCode
from phase_traj_ros.core.code_series import Code, CodeSeries

_CODES = range(4)
_NUMBER = r'(0|[1-9]\d*)'
_SERIES = re.compile(
    _NUMBER + r' \(' + ' '.join(f'{code}:{_NUMBER}' for code in _CODES) + r'\)( \.\.\.)?'
    r'((?: [0-3]x[1-9]\d*)*)', re.ASCII)
_TEXT = re.compile(f'frames {_NUMBER}; movement (.*); direction (.*)', re.ASCII)


@dataclass(frozen=True, slots=True)
class SeriesText:
    """One series of codes as far as the text tells it."""

    length: int
    totals: tuple[int, int, int, int]
    """How often each of the codes 0 to 3 occurred."""
    runs: tuple[tuple[int, int], ...]
    """(code, count) of the newest runs, oldest first."""
    complete: bool
    """Whether the runs are all there ever were."""

    def __str__(self) -> str:
        """Return the series in the grammar of this module."""
        totals = ' '.join(f'{code}:{total}' for code, total in zip(_CODES, self.totals))
        runs = ''.join(f' {code}x{count}' for code, count in self.runs)
        return f'{self.length} ({totals}){"" if self.complete else " ..."}{runs}'


@dataclass(frozen=True, slots=True)
class ChainCodeText:
    """Both codes as far as the text tells them."""

    frames: int
    movement: SeriesText
    direction: SeriesText

    def __str__(self) -> str:
        """Return the line in the grammar of this module."""
        return f'frames {self.frames}; movement {self.movement}; direction {self.direction}'


def describe(
    codes: ChainCode, *, frames: int, max_runs: int | None = None,
) -> ChainCodeText:
    """Return what the text tells of ``codes``, with at most ``max_runs`` runs a series."""
    return ChainCodeText(
        frames, _series_text(codes.movement, max_runs), _series_text(codes.direction, max_runs))


def parse(text: str) -> ChainCodeText:
    """
    Return what a line in the grammar of this module says.

    Raises
    ------
    ValueError
        The text does not follow the grammar, or its numbers do not add up.

    """
    match = _TEXT.fullmatch(text)
    if match is None:
        raise ValueError(f'not a chain code text: {text!r:.80}')
    frames, movement, direction = match.groups()
    return ChainCodeText(int(frames), _parse_series(movement), _parse_series(direction))


def _series_text(series: CodeSeries[Code], max_runs: int | None) -> SeriesText:
    runs = series.runs if max_runs is None else series.last_runs(max_runs)
    kept = sum(run.count for run in runs)
    counts = dict.fromkeys(_CODES, 0) | {int(code): count for code, count in series.totals.items()}
    return SeriesText(
        length=len(series),
        totals=(counts[0], counts[1], counts[2], counts[3]),
        runs=tuple((int(run.code), run.count) for run in runs),
        complete=kept == len(series),
    )


def _parse_series(text: str) -> SeriesText:
    match = _SERIES.fullmatch(text)
    if match is None:
        raise ValueError(f'not a series of codes: {text!r:.80}')
    length, *totals, dots, runs_text = match.groups()
    left, forward, right, other = (int(total) for total in totals)
    runs = tuple(
        (int(code), int(count))
        for code, count in (run.split('x') for run in runs_text.split()))
    series = SeriesText(
        int(length), (left, forward, right, other), runs, complete=dots is None)
    _check_sums(series)
    return series


def _check_sums(series: SeriesText) -> None:
    shown = [sum(count for run_code, count in series.runs if run_code == code) for code in _CODES]
    short = sum(shown) < series.length
    if (sum(series.totals) != series.length or short == series.complete
            or any(part > total for part, total in zip(shown, series.totals))):
        raise ValueError(f'the numbers of this series do not add up: {str(series)!r:.80}')
