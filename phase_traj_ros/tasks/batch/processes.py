# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""An executor with processes that are isolated from each other."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process, resource_tracker
import os
from queue import SimpleQueue
import signal
from threading import Thread
from typing import Any, ParamSpec, TypeVar

import cv2
from phase_traj_ros.io.outputs.commit import STOPPING

_P = ParamSpec('_P')
_T = TypeVar('_T')

# How often a call is tried whose process dies; the caller may give up earlier.
_MOST_ATTEMPTS = 3
_JOIN_S = 30.0


class IsolatedProcesses(Executor):
    """
    Runs calls in processes, one call at a time in each.

    If a process dies (killed, or out of memory), its call is tried again in a new process and no
    other call is concerned, unlike in a ProcessPoolExecutor.
    """

    def __init__(self, workers: int) -> None:
        """Run calls in up to ``workers`` processes, at least 1."""
        self._calls: SimpleQueue[tuple[Future[Any], tuple[Any, ...], dict[str, Any]] | None] = (
            SimpleQueue())
        self._threads = [
            Thread(target=self._work, name='replay slot', daemon=True) for _ in range(workers)]
        for thread in self._threads:
            thread.start()

    def submit(
        self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs,
    ) -> Future[_T]:
        """Run a call in one of the processes; return its future."""
        future: Future[_T] = Future()
        self._calls.put((future, (fn, *args), kwargs))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes after their calls; wait for them, but not for ever."""
        for _ in self._threads:
            self._calls.put(None)
        if wait:
            for thread in self._threads:
                thread.join(_JOIN_S)

    def _work(self) -> None:
        _block_signals()
        slot = _Slot()
        while (call := self._calls.get()) is not None:
            future, arguments, options = call
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(slot.run(*arguments, **options))
            except BaseException as error:
                future.set_exception(error)
        slot.end()


class _Slot:
    """A process, and another one whenever it dies."""

    def __init__(self) -> None:
        self._pool: ProcessPoolExecutor | None = None

    def run(self, *arguments: Any, **options: Any) -> Any:
        for attempt in range(1, _MOST_ATTEMPTS + 1):
            if self._pool is None:
                self._pool = ProcessPoolExecutor(
                    1, mp_context=get_context('spawn'), initializer=_begin_worker)
            try:
                return self._pool.submit(*arguments, **options).result()
            except BrokenProcessPool:
                self._pool = None
                if attempt == _MOST_ATTEMPTS:
                    raise
        raise AssertionError

    def end(self) -> None:
        if self._pool is not None:
            self._pool.shutdown()


def _block_signals() -> None:
    """
    Block the signals that stop a program, in this thread and the processes that it starts.

    The parent process decides when to stop, but a terminal sends its signals to all processes,
    also to those that are still starting.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, STOPPING)
    # It belongs to all processes and has to be the first; starting it unblocks signals.
    resource_tracker.ensure_running()
    signal.pthread_sigmask(signal.SIG_BLOCK, STOPPING)


def _begin_worker() -> None:
    """Prepare a worker process."""
    Thread(target=_follow_parent, daemon=True).start()
    cv2.setNumThreads(1)


def _follow_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
