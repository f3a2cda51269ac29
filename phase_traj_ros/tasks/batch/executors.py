# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The executors of a batch: isolated processes of this machine, or a Dask cluster."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from multiprocessing import get_context, parent_process, resource_tracker
import os
import signal
from threading import get_ident, Thread
from typing import ParamSpec, TypeVar

import cv2
from phase_traj_ros.errors import needing, ParameterError
from phase_traj_ros.io.outputs.commit import STOPPING

_P = ParamSpec('_P')
_T = TypeVar('_T')

# How often a call is tried whose process dies; the caller may give up earlier.
_MOST_ATTEMPTS = 3
_ANSWER_S = 30


class IsolatedProcesses(ThreadPoolExecutor):
    """
    Runs calls in processes, one call at a time in each.

    If a process dies (killed, or out of memory), its call is tried again in a new process and no
    other call is concerned, unlike in a ProcessPoolExecutor. So each thread has its own.
    """

    def __init__(self, workers: int) -> None:
        """Run calls in up to ``workers`` processes, at least 1."""
        super().__init__(workers, initializer=_block_signals)
        self._own: dict[int, ProcessPoolExecutor] = {}

    def submit(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> Future[_T]:
        """Run a call in one of the processes; return its future."""
        return super().submit(self._isolated, fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes after their calls."""
        super().shutdown(wait, cancel_futures=cancel_futures)
        for process in self._own.values():
            process.shutdown(wait)

    def _isolated(self, fn: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> _T:
        """Run a call in the process of this thread, and in another one whenever it dies."""
        process = self._own.get(get_ident()) or _process()
        try:
            for _ in range(_MOST_ATTEMPTS - 1):
                with suppress(BrokenProcessPool):
                    return process.submit(fn, *args, **kwargs).result()
                process = _process()
            return process.submit(fn, *args, **kwargs).result()
        finally:
            self._own[get_ident()] = process


@contextmanager
def dask_executor(address: str) -> Iterator[Executor]:
    """
    Yield an executor that runs calls on a Dask cluster.

    Each worker needs this package, and the sources and the folder of results under the same
    paths. If a worker dies, the scheduler gives its call to another one. If the scheduler ends,
    the futures are cancelled.

    Parameters
    ----------
    address
        Address of the scheduler, such as tcp://host:8786.

    Raises
    ------
    MissingDependencyError
        dask or distributed is not installed.
    ParameterError
        No scheduler answers at the address, or it has no workers.

    """
    with needing('a dask cluster needs dask and distributed', 'install phase_traj_ros[dask]'):
        from distributed import Client
    try:
        client = Client(address, timeout=_ANSWER_S)
    except (OSError, ValueError) as error:
        raise ParameterError(
            f'dask at {address}: no scheduler answers there ({error}); start one with'
            ' dask-scheduler, or check the address') from None
    try:
        try:
            client.wait_for_workers(1, timeout=_ANSWER_S)
        except TimeoutError:
            raise ParameterError(
                f'dask at {address}: the scheduler has no workers; start some with dask-worker'
            ) from None
        # Not pure: a source that is requested again is replayed again.
        yield client.get_executor(pure=False)
    finally:
        # The scheduler may have ended.
        with suppress(Exception):
            client.close(timeout=_ANSWER_S)


def _process() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(1, mp_context=get_context('spawn'), initializer=_begin_worker)


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
