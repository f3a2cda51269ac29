# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables that are readable on a terminal and in Markdown, and the description of the machine."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime, timezone
import os
from pathlib import Path
import platform
import textwrap

from benchmarks.shared.timing import Bystanders, PINNED
import cv2
import numpy as np

#: Load of other programs that is reported: they compete for caches and memory as well.
_BUSY_CORES = 0.1

ROOT = Path(__file__).resolve().parents[2]
MEASUREMENTS = ROOT / 'docs' / 'measurements'


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table with columns as wide as their content."""
    cells = [[str(cell) for cell in row] for row in (header, *rows)]
    widths = [max(len(row[column]) for row in cells) for column in range(len(header))]
    lines = ['| ' + ' | '.join(cell.ljust(width) for cell, width in zip(row, widths)) + ' |'
             for row in cells]
    lines.insert(1, '|' + '|'.join('-' * (width + 2) for width in widths) + '|')
    return '\n'.join(lines)


def paragraphs(text: str) -> str:
    """Return text wrapped to the width of the docs, one block per paragraph or list item."""
    blocks = (' '.join(block.split()) for block in text.split('\n\n'))
    return '\n\n'.join(
        textwrap.fill(block, 99, break_on_hyphens=False,
                      subsequent_indent='  ' if block.startswith('- ') else '')
        for block in blocks)


def write_page(name: str, blocks: Iterable[str]) -> None:
    """Write docs/measurements/NAME.md from its headings, paragraphs and tables."""
    path = MEASUREMENTS / f'{name}.md'
    path.write_text('\n\n'.join(blocks) + '\n', encoding='utf-8')
    print(f'written to {path}')


def verdict(value: float, limit: float | None) -> str:
    """Return whether a value is within its limit, in a word; nothing without a limit."""
    return '' if limit is None else all_met(value <= limit)


def all_met(*facts: bool) -> str:
    """Return whether all of these hold, in a word."""
    return 'yes' if all(facts) else '**no**'


def disturbance(watched: Bystanders) -> str:
    """Return a line on the load of other programs meanwhile."""
    if watched.cores is None:
        return 'What else ran on the machine meanwhile is not known.'
    text = f'Other programs kept {watched.cores:.2f} of the cores busy meanwhile'
    return f'{text}: **measure again.**' if watched.cores > _BUSY_CORES else f'{text}.'


def versions() -> str:
    """Return the versions of the libraries that affect the results."""
    return (f'Python {platform.python_version()}, numpy {np.__version__}, '
            f'OpenCV {cv2.__version__} {transforms()}')


def transforms() -> str:
    """Return whose Fourier transforms OpenCV uses."""
    if not (hasattr(cv2, 'ipp') and cv2.ipp.useIPP()):
        return '(its own transforms)'
    return f'(transforms of Intel IPP {cv2.ipp.getIppVersion().partition("(-)")[0].strip()})'


def machine() -> str:
    """Return the table that describes the machine."""
    pinned = ' '.join(f'{name}={value}' for name, value in PINNED.items())
    return table(('', ''), (
        ('processor', f'{_processor()}, {os.cpu_count()} cores'),
        ('system', f'{platform.system()} {platform.machine()}, {" ".join(platform.libc_ver())}'),
        ('versions', versions()),
        ('allocator', f'`{pinned}`'),
        ('date', datetime.now(timezone.utc).date().isoformat()),
    ))


def _processor() -> str:
    try:
        lines = Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines()
    except OSError:
        lines = []
    names = [line.partition(':')[2].strip() for line in lines if line.startswith('model name')]
    return names[0] if names else platform.machine()
