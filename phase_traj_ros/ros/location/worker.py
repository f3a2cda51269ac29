# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs the locator in a thread with a queue, so that a slow step delays no frame."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from queue import SimpleQueue
import threading

from phase_traj_ros.core import LocationEstimate, MapLocator, Odometry, PositionFix
from phase_traj_ros.tasks.location.motion import ANYWHERE, Motion
from phase_traj_ros.tasks.location.run import feed

# Largest number of waiting pairs and fixes. More are dropped; dropped pairs are an interruption.
_MOST_WAITING = 6000


@dataclass(frozen=True, slots=True)
class Moved:
    """
    A pair of frames to locate.

    stamp_ns
        Stamp of its second frame, in nanoseconds.
    motions
        Input of the locator for the pair.
    odometry
        Odometry after the pair, in metres; None if it is unknown.
    """

    stamp_ns: int
    motions: Sequence[Motion]
    odometry: Odometry | None = None


class LocatorWorker:
    """Runs a locator in a thread; its methods may be called from any other thread."""

    def __init__(self, locator: MapLocator) -> None:
        """Start the thread."""
        self._locator = locator
        self._tasks: SimpleQueue[Moved | PositionFix | None] = SimpleQueue()
        self._placed: deque[tuple[Moved, LocationEstimate]] = deque(maxlen=_MOST_WAITING)
        self._leaves_out = False
        self._closing = threading.Event()
        self.fixes_used = 0
        """Position fixes that the locator has used."""
        self.fixes_refused = 0
        """Position fixes that it has not used, see ``MapLocator.fix``."""
        self.left_out = 0
        """Pairs that were dropped because too many were waiting."""
        self.failure: Exception | None = None
        """The error that ended the thread; None without one."""
        self._thread = threading.Thread(target=self._run, name='locator', daemon=True)
        self._thread.start()

    @property
    def waiting(self) -> int:
        """Return the number of waiting pairs and fixes."""
        return self._tasks.qsize()

    def add(self, moved: Moved) -> None:
        """Queue a pair; drop it if too many are waiting."""
        if self.waiting >= _MOST_WAITING:
            self._leaves_out = True
            self.left_out += 1
            return
        if self._leaves_out:
            self._leaves_out = False
            self._tasks.put(Moved(moved.stamp_ns, (ANYWHERE,)))
        self._tasks.put(moved)

    def fix(self, fix: PositionFix) -> None:
        """Queue a position fix; drop it if too many are waiting."""
        if self.waiting < _MOST_WAITING:
            self._tasks.put(fix)

    def take(self) -> list[tuple[Moved, LocationEstimate]]:
        """Return the pairs located since the last call and the estimates, oldest first."""
        return [self._placed.popleft() for _ in range(len(self._placed))]

    def close(self) -> None:
        """Stop the thread after the step in progress, and wait for it."""
        self._closing.set()
        self._tasks.put(None)
        self._thread.join()

    def _run(self) -> None:
        try:
            while (task := self._tasks.get()) is not None and not self._closing.is_set():
                self._do(task)
        except Exception as error:  # The node reports it, and continues without a place.
            self.failure = error

    def _do(self, task: Moved | PositionFix) -> None:
        if isinstance(task, Moved):
            self._placed.append((task, feed(self._locator, task.motions)))
        elif self._locator.fix(task):
            self.fixes_used += 1
        else:
            self.fixes_refused += 1
