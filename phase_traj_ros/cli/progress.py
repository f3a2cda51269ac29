# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A progress bar where there is somebody to see it."""

from collections.abc import Iterable
import sys
from typing import TypeVar

Item = TypeVar('Item')


def progress(items: Iterable[Item], *, total: int | None, title: str) -> Iterable[Item]:
    """Show a bar on the terminal while ``items`` are taken; without tqdm, show none."""
    if not sys.stderr.isatty():
        return items
    try:
        from tqdm import tqdm
    except ImportError:
        return items
    bar: Iterable[Item] = tqdm(items, total=total, desc=title, unit=' frames', leave=False)
    return bar
