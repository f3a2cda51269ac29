# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads the chain code of equal links from a text file or the output of ``ros2 topic echo``."""

from __future__ import annotations

from pathlib import Path
import re
from typing import Final

from phase_traj_ros.core import LengthUnit
from phase_traj_ros.core.codes.links import MIN_STEP
from phase_traj_ros.core.codes.text import LinksText, parse_links
from phase_traj_ros.errors import SourceError

# A line of equal links, bare or as ``ros2 topic echo`` prints it.
_MESSAGE: Final = re.compile(r"""^[ \t]*(?:data:[ \t]*)?['"]?(step [^'"\r\n]*)""", re.MULTILINE)
_UNITS: Final = (LengthUnit.METRE.value, LengthUnit.CAMERA_HEIGHT.value)
# Longer links do not tell streets apart. More links would need too much memory.
_LONGEST, _MOST = 100.0, 200_000


def find_links(path: Path, content: bytes) -> LinksText | None:
    """
    Return the last line of equal links in the content of a file; None if there is none.

    Raises
    ------
    SourceError
        The line is cut off or malformed, lacks links of the drive, has none or too many, or their
        unit or length is not supported.

    """
    lines = _MESSAGE.findall(content.decode('utf-8-sig', 'replace'))
    if not lines:
        return None
    line = lines[-1].rstrip()
    if line.endswith('...'):
        raise SourceError(
            f'{path}: the last line is cut off: record it with `ros2 topic echo --full-length`')
    try:
        text = parse_links(line)
    except ValueError as error:
        raise SourceError(f'{path}: {error}') from None
    series = text.links
    if not series.length:
        raise SourceError(f'{path} has no link: the drive is shorter than one')
    if not series.complete:
        raise SourceError(f'{path} does not have all links of a drive: older ones are left out')
    if text.unit not in _UNITS:
        raise SourceError(
            f'{path} has links in the unit {text.unit!r}: give links in {" or ".join(_UNITS)}')
    if not MIN_STEP <= text.step <= _LONGEST:
        raise SourceError(
            f'{path} has links of {text.step:g} {text.unit}: give links of {MIN_STEP:g} to'
            f' {_LONGEST:g}')
    if series.length > _MOST:
        raise SourceError(f'{path} has {series.length} links: give a drive of at most {_MOST}')
    return text
