# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads times.txt, the stamps of the pictures or poses beside it."""

from collections.abc import Iterator
from decimal import Decimal
import os
from pathlib import Path
import re

from phase_traj_ros.errors import reading, SourceError

TIMES_FILE = 'times.txt'
"""Name of the file with the stamp of each picture, in seconds, one per line."""

_MAX_SECONDS = Decimal(2 ** 63 // 10 ** 9)


def both_ways(path: Path) -> Iterator[Path]:
    """Yield the absolute path as it was typed, and then with its symbolic links resolved."""
    # Not absolute(): the parent of "." would be "." again.
    yield Path(os.path.abspath(path))
    yield path.resolve()


def find_times(source: Path) -> Path | None:
    """Return the times.txt in a folder or beside it or a file; None if there is none."""
    for place in (source, *(each.parent for each in both_ways(source))):
        times = place / TIMES_FILE
        if times.is_file():
            return times
    return None


def read_times(path: Path) -> list[int]:
    """
    Read a file with a time in seconds on each line; return exactly rounded nanoseconds.

    Blank lines at the end are ignored. Raises SourceError.
    """
    with reading(path):
        lines = path.read_text(encoding='utf-8-sig').rstrip().splitlines()
    stamps = []
    for number, line in enumerate(lines, 1):
        try:
            stamps.append(nanoseconds(line.strip()))
        except ValueError as error:
            raise SourceError(
                f'{path}, line {number}: {error}; correct it, or give fps to ignore the file',
            ) from None
    return stamps


def nanoseconds(seconds: str) -> int:
    """Return a text of seconds in exactly rounded nanoseconds; raises ValueError."""
    try:
        time = Decimal(seconds)
        if abs(time) < _MAX_SECONDS:
            return round(time * 1_000_000_000)
    except ArithmeticError:
        pass
    raise ValueError(f'{seconds[:40]!r} is not a time in seconds')


def stamps_of_pictures(pictures: list[Path], times: Path) -> list[int]:
    """
    Return the stamp of each picture in nanoseconds, from a times.txt.

    If it has as many lines as there are pictures, lines and pictures correspond; otherwise the
    name of each picture is the number of its line, from 0 on. Raises SourceError if neither holds.
    """
    stamps = read_times(times)
    if len(stamps) == len(pictures):
        return stamps
    chosen = [
        stamps[int(picture.stem)] for picture in pictures
        if re.fullmatch('[0-9]+', picture.stem) and int(picture.stem) < len(stamps)]
    if len(chosen) != len(pictures):
        raise SourceError(
            f'{times} has {len(stamps)} lines for {len(pictures)} images, and their names are '
            'not line numbers; give fps to ignore the file')
    return chosen
