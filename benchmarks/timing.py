# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
How things are timed: side by side, in turns, in one process, with a pinned allocator.

glibc's malloc gives buffers of a megabyte back to the kernel and fetches them anew, or not,
depending on what was allocated before: the same call takes twice or three times as long. And
what runs right before leaves the cache warm or cold. So figures of two processes, or of two
loops one after the other, say little; ratios of calls that took turns do.

What is timed is the processor time of the whole process. On one thread that is the time it takes,
without what other programs took in between; and should a contestant use more threads than it is
allowed, all of them count.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
import gc
import os
import random
import sys
import time
from typing import Any

import cv2
import numpy as np

#: Buffers come from the heap, and the heap is never given back.
PINNED = {
    'MALLOC_MMAP_THRESHOLD_': str(2 ** 30),
    'MALLOC_TRIM_THRESHOLD_': str(2 ** 31),
    'MALLOC_TOP_PAD_': str(2 ** 26),
}


def prepare() -> None:
    """Start this program anew with the allocator pinned, if it is not; let OpenCV use a thread."""
    if any(os.environ.get(name) != value for name, value in PINNED.items()):
        sys.stdout.flush()
        os.execve(sys.executable, sys.orig_argv, {**os.environ, **PINNED})
    cv2.setNumThreads(1)


def unpinned() -> dict[str, str]:
    """Return the environment of a program that runs as its users run it."""
    return {name: value for name, value in os.environ.items() if name not in PINNED}


@dataclass(frozen=True, slots=True)
class Quartiles:
    """The middle half of many measurements."""

    low: float
    median: float
    high: float

    @classmethod
    def of(cls, values: Iterable[float]) -> Quartiles:
        """Return the quartiles of ``values``."""
        return cls(*np.quantile(np.fromiter(values, float), (0.25, 0.5, 0.75)).tolist())


@dataclass(frozen=True, slots=True)
class Timed:
    """What one contestant took in each round, and what it returned."""

    seconds: list[float] = field(default_factory=list)
    """Processor time."""
    wall: list[float] = field(default_factory=list)
    """By the clock on the wall, in seconds."""
    results: list[Any] = field(default_factory=list)

    def extend(self, more: Timed) -> None:
        """Add further rounds."""
        self.seconds.extend(more.seconds)
        self.wall.extend(more.wall)
        self.results.extend(more.results)

    @property
    def ms(self) -> float:
        """Return the median in milliseconds."""
        return 1e3 * float(np.median(self.seconds))


def take_turns(
    contestants: Mapping[str, Callable[[Any], Any]], items: Iterable[Any], *, warm_up: int = 5,
) -> dict[str, Timed]:
    """
    Give every item to every contestant; the order changes with every item.

    Two swap places, more are shuffled. The first ``warm_up`` items are not timed.
    """
    rng = random.Random(0)
    order = list(contestants)
    timed = {name: Timed() for name in order}
    gc.collect()
    gc.disable()
    try:
        for number, item in enumerate(items):
            if len(order) == 2:
                order.reverse()
            else:
                rng.shuffle(order)
            for name in order:
                wall, cpu = time.perf_counter(), time.process_time()
                result = contestants[name](item)
                cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
                if number >= warm_up:
                    timed[name].extend(Timed([cpu], [wall], [result]))
    finally:
        gc.enable()
    return timed


@dataclass(slots=True)
class Bystanders:
    """How much of the machine was taken by something else while something was measured."""

    cores: float | None = None
    """Cores that other programs kept busy, or the host of a virtual machine took; None unknown."""


@contextmanager
def bystanders() -> Iterator[Bystanders]:
    """Watch what runs besides this process in the block; yields what is known at its end."""
    watched = Bystanders()
    wall, own, all_cores = time.perf_counter(), time.process_time(), _busy_s()
    yield watched
    if all_cores is not None:
        others = (_busy_s() or 0.0) - all_cores - (time.process_time() - own)
        watched.cores = max(others, 0.0) / (time.perf_counter() - wall)


def _busy_s() -> float | None:
    """Return the seconds that all cores have worked since the start, or None if not known."""
    try:
        with open('/proc/stat', encoding='ascii') as file:
            user, nice, system, _, _, *rest = map(int, file.readline().split()[1:9])
    except (OSError, ValueError):
        return None
    return (user + nice + system + sum(rest)) / os.sysconf('SC_CLK_TCK')


def ratios(ours: Timed, theirs: Timed) -> Quartiles:
    """Return how the ratio of the two spreads over the rounds."""
    return Quartiles.of(a / b for a, b in zip(ours.seconds, theirs.seconds))
