# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The chain code as one line of text for people, and its parser.

Grammar (a space stands for exactly one)::

    text    = "frames " n "; movement " series "; direction " series
    series  = n " (0:" n " 1:" n " 2:" n " 3:" n ")" [" ..."] *(" " code "x" n)
    code    = "0" | "1" | "2" | "3"
    n       = a decimal number without sign

The first number of a series is its length, the brackets hold how often each code occurred, and
the runs follow, oldest first; ``...`` means that older runs are omitted. With Freeman's eight
directions, the brackets and the codes of the second series go up to 7. For example::

    frames 34; movement 33 (0:0 1:25 2:1 3:7) 1x23 2x1 3x7 1x2; direction 26 (...) 1x23 2x3

The code of equal links is a separate line, with the length of a link and its unit::

    links   = "step " length " " unit "; links " series

For example::

    step 2.5 m; links 26 (0:0 1:23 2:3 3:0) 1x23 2x3
"""

from dataclasses import dataclass
import re
from typing import Any

from phase_traj_ros.core.codes.chain import ChainCode
from phase_traj_ros.core.codes.codes import Code, Movement
from phase_traj_ros.core.codes.links import LinkCode
from phase_traj_ros.core.codes.series import CodeSeries

_TEXT = re.compile(r'frames (\d+); movement (.*); direction (.*)', re.ASCII)
_LINKS = re.compile(r'step (\d+(?:\.\d+)?) ([a-z ]+); links (.*)', re.ASCII)
# Looser than the grammar: a parsed series has to be written as it was read.
_SERIES = re.compile(r'(\d+) \(((?:\d:\d+ ?)+)\)( \.\.\.)?((?: \dx[1-9]\d*)*)', re.ASCII)


@dataclass(frozen=True, slots=True)
class SeriesText:
    """One series of codes, as far as the text contains it."""

    length: int
    totals: tuple[int, ...]
    """How often each code, from 0 on, occurred; 4 or 8 numbers."""
    runs: tuple[tuple[int, int], ...]
    """(code, count) of the newest runs, oldest first."""
    complete: bool
    """Whether ``runs`` contains all runs."""

    def __str__(self) -> str:
        """Return the series in the grammar of docs/reference/topics.md."""
        totals = ' '.join(f'{code}:{total}' for code, total in enumerate(self.totals))
        runs = ''.join(f' {code}x{count}' for code, count in self.runs)
        return f'{self.length} ({totals}){"" if self.complete else " ..."}{runs}'


@dataclass(frozen=True, slots=True)
class ChainCodeText:
    """Both codes, as far as the text contains them."""

    frames: int
    movement: SeriesText
    direction: SeriesText

    def __str__(self) -> str:
        """Return the line in the grammar of docs/reference/topics.md."""
        return f'frames {self.frames}; movement {self.movement}; direction {self.direction}'


@dataclass(frozen=True, slots=True)
class LinksText:
    """The code of equal links, as far as the text contains it."""

    step: float
    """Length of a link."""
    unit: str
    """Unit of the step, such as ``m``."""
    links: SeriesText

    def __str__(self) -> str:
        """Return the line in the grammar of docs/reference/topics.md."""
        return f'step {self.step:.12g} {self.unit}; links {self.links}'


def describe(codes: ChainCode, *, frames: int, max_runs: int | None = None) -> ChainCodeText:
    """Return the text form of ``codes``, with at most ``max_runs`` runs per series."""
    return ChainCodeText(
        frames, _series_text(codes.movement, Movement, max_runs),
        _series_text(codes.direction, codes.directions, max_runs))


def describe_links(code: LinkCode, *, unit: str, max_runs: int | None = None) -> LinksText:
    """Return the text form of the equal links, with at most ``max_runs`` runs."""
    return LinksText(code.step, unit, _series_text(code.series, code.directions, max_runs))


def parse_links(text: str) -> LinksText:
    """
    Parse a line of equal links.

    Raises
    ------
    ValueError
        The text does not follow the grammar, or its numbers do not add up.

    """
    match = _LINKS.fullmatch(text)
    if match is None:
        raise ValueError(f'not a text of equal links: {text!r:.80}')
    step, unit, links = match.groups()
    return LinksText(float(step), unit, _parse_series(links))


def parse_chain_code(text: str) -> ChainCodeText:
    """
    Parse a line in the grammar of docs/reference/topics.md.

    Raises
    ------
    ValueError
        The text does not follow the grammar, or its numbers do not add up.

    """
    match = _TEXT.fullmatch(text)
    if match is not None:
        frames, movement, direction = match.groups()
        found = ChainCodeText(int(frames), _parse_series(movement), _parse_series(direction))
        if str(found) == text and len(found.movement.totals) == len(Movement):
            return found
    raise ValueError(f'not a chain code text: {text!r:.80}')


def _series_text(series: CodeSeries[Any], codes: type[Code], max_runs: int | None) -> SeriesText:
    runs = series.runs if max_runs is None else series.last_runs(max_runs)
    return SeriesText(
        len(series), series.totals_of(codes), tuple((int(run.code), run.count) for run in runs),
        complete=sum(run.count for run in runs) == len(series))


def _parse_series(text: str) -> SeriesText:
    match = _SERIES.fullmatch(text)
    if match is not None:
        length, totals, dots, runs = match.groups()
        series = SeriesText(
            int(length), tuple(int(each[2:]) for each in totals.split()),
            tuple((int(run[0]), int(run[2:])) for run in runs.split()), complete=dots is None)
        if str(series) == text and len(series.totals) in (4, 8):
            _check_sums(series)
            return series
    raise ValueError(f'not a series of codes: {text!r:.80}')


def _check_sums(series: SeriesText) -> None:
    shown = [
        sum(count for run_code, count in series.runs if run_code == code)
        for code in range(len(series.totals))]
    short = sum(shown) < series.length
    if (sum(series.totals) != series.length or short == series.complete
            or any(part > total for part, total in zip(shown, series.totals))):
        raise ValueError(f'the numbers of this series do not add up: {str(series)!r:.80}')
