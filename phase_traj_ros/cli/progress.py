# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Progress bars, shown only on a terminal."""

from collections.abc import Iterable
from typing import Any

from phase_traj_ros.cli.escaping import escaped, screen
from phase_traj_ros.io.sources.base import Entry
from phase_traj_ros.tasks.batch.job import Through
from tqdm import tqdm

BY_SOURCE = '{desc}: {percentage:3.0f}%|{bar}| {n:.1f} of {total} [{elapsed}<{remaining}]'
"""Layout of a bar that counts sources in fractions."""


def progress(
    items: Iterable[Any] | None = None, *, total: int | None, title: str,
    layout: str | None = None,
) -> Any:
    """
    Return a tqdm bar over ``items``, or one to advance by hand with ``update``.

    It is shown on a terminal only.
    """
    return tqdm(
        items, total=total, desc=escaped(title), unit=' frames', leave=False, disable=None,
        file=screen(), bar_format=layout)


def over_passes(*, total: int | None, title: str) -> Through:
    """Return what shows a bar over the frames of each pass of a replay."""
    def shown(frames: Iterable[Entry], which: str) -> Iterable[Entry]:
        name = f'{title}, {which}' if which else title
        bar: Iterable[Entry] = progress(frames, total=total, title=name)
        return bar
    return shown
