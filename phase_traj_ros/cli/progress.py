# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Progress bars, shown only on a terminal."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
import sys
from typing import TypeVar

from phase_traj_ros.cli.escaping import escaped, screen

Item = TypeVar('Item')


def progress(items: Iterable[Item], *, total: int | None, title: str) -> Iterator[Item]:
    """Show a bar on the terminal while ``items`` are consumed; without tqdm, show none."""
    with counter(total=total, title=title) as advance:
        for item in items:
            yield item
            advance()


@contextmanager
def counter(*, total: int | None, title: str) -> Iterator[Callable[[], object]]:
    """Show a bar on the terminal; yield a function that advances it by one frame."""
    if sys.stderr.isatty():
        try:
            from tqdm import tqdm
        except ImportError:
            pass
        else:
            with tqdm(
                    total=total, desc=escaped(title), unit=' frames', leave=False,
                    file=screen()) as bar:
                yield bar.update
            return
    yield lambda: None


@contextmanager
def gauge(*, total: int, title: str) -> Iterator[Callable[[float], object]]:
    """Show a bar on the terminal; yield a function that sets it to a fraction of ``total``."""
    if sys.stderr.isatty():
        try:
            from tqdm import tqdm
        except ImportError:
            pass
        else:
            layout = '{desc}: {percentage:3.0f}%|{bar}| {n:.1f} of {total} [{elapsed}<{remaining}]'
            with tqdm(
                    total=total, desc=escaped(title), bar_format=layout, leave=False,
                    file=screen()) as bar:
                yield lambda done: bar.update(done - bar.n)
            return
    yield lambda _: None
