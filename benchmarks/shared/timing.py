# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Timing: side by side, alternating, in one process, with a pinned allocator.

glibc's malloc may return buffers of a megabyte to the kernel and request them again, depending on
earlier allocations: the same call then takes two or three times as long. The previous call leaves
the cache warm or cold. So times of two processes, or of two loops one after the other, are of
little value; ratios of alternating calls are reliable.

The processor time of the whole process is measured. On one thread, that is the elapsed time
without the time taken by other programs. If a contestant uses more threads than allowed, all of
them count.
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

#: Buffers come from the heap, and the heap is never returned.
PINNED = {
    'MALLOC_MMAP_THRESHOLD_': str(2 ** 30),
    'MALLOC_TRIM_THRESHOLD_': str(2 ** 31),
    'MALLOC_TOP_PAD_': str(2 ** 26),
}


def prepare() -> None:
    """Restart this program with a pinned allocator, if necessary; limit OpenCV to one thread."""
    if any(os.environ.get(name) != value for name, value in PINNED.items()):
        sys.stdout.flush()
        os.execve(sys.executable, sys.orig_argv, {**os.environ, **PINNED})
    cv2.setNumThreads(1)


def unpinned() -> dict[str, str]:
    """Return the environment of a program as users run it."""
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
    """Times of one contestant in each round, and its return values."""

    seconds: list[float] = field(default_factory=list)
    """Processor time."""
    wall: list[float] = field(default_factory=list)
    """Wall-clock time, in seconds."""
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
    Pass every item to every contestant; the order changes with every item.

    Two contestants swap places, more are shuffled. The first ``warm_up`` items are not timed.
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
    """Load of the machine by other programs during a measurement."""

    cores: float | None = None
    """Cores used by other programs or by the host of a virtual machine; None if unknown."""


@contextmanager
def bystanders() -> Iterator[Bystanders]:
    """Watch the load of other programs in the block; the value is available at its end."""
    watched = Bystanders()
    wall, own, all_cores = time.perf_counter(), _own_s(), _busy_s()
    yield watched
    if all_cores is not None:
        others = (_busy_s() or 0.0) - all_cores - (_own_s() - own)
        watched.cores = max(others, 0.0) / (time.perf_counter() - wall)


def _own_s() -> float:
    """Return the processor time in seconds of this process and of those that it has waited for."""
    return sum(os.times()[:4])


def _busy_s() -> float | None:
    """Return the total busy time of all cores in seconds, or None if not known."""
    try:
        with open('/proc/stat', encoding='ascii') as file:
            user, nice, system, _, _, *rest = map(int, file.readline().split()[1:9])
    except (OSError, ValueError):
        return None
    return (user + nice + system + sum(rest)) / os.sysconf('SC_CLK_TCK')


def ratios(ours: Timed, theirs: Timed) -> Quartiles:
    """Return the distribution of the ratio of the two over the rounds."""
    return Quartiles.of(a / b for a, b in zip(ours.seconds, theirs.seconds))
