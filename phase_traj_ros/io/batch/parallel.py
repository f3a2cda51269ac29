# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs jobs in parallel processes, isolated from each other."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process
from multiprocessing.sharedctypes import RawArray
import os
from queue import Empty, SimpleQueue
import signal
from threading import Thread
from typing import Any, Final

import cv2
from phase_traj_ros.io.batch.many import failure, Job, Outcome, Progress, run_job
from phase_traj_ros.io.outputs.commit import STOPPING

ATTEMPTS: Final = 2
"""How often a job is tried if its process dies."""

_POLL_S = 0.1
# Shared memory between a slot and its process. Plain numbers without a lock: a process that is
# killed while it holds a lock would never release it.
_DONE, _EXPECTED, _STOP = range(3)

Run = Callable[[Job, Progress], Outcome]


def run_parallel(
    jobs: Sequence[Job], *, workers: int, run: Run = run_job,
    on_progress: Callable[[float], object] = lambda done: None,
) -> Generator[Outcome, None, None]:
    """
    Yield the outcomes of all jobs in the order in which they finish.

    Each worker is a separate process. If one dies (killed, or out of memory), its job is tried
    once more in a new process, and then reported as failed. Closing the generator stops all jobs
    after their current frame.

    Parameters
    ----------
    jobs
        The jobs to run.
    workers
        Number of parallel processes, at least 1.
    run
        Runs a job; a function that other processes can import.
    on_progress
        Called several times a second with the number of finished jobs, including fractions. The
        number never decreases, also when a job starts again.

    """
    todo: SimpleQueue[Job] = SimpleQueue()
    done: SimpleQueue[Outcome] = SimpleQueue()
    for job in jobs:
        todo.put(job)
    slots = [_Slot(todo, done, run) for _ in range(min(workers, len(jobs)))]
    try:
        finished, reported = 0, 0.0
        while finished < len(jobs):
            try:
                outcome = done.get(timeout=_POLL_S)
            except Empty:
                outcome = None
            else:
                finished += 1
            reported = max(reported, finished + sum(slot.fraction for slot in slots))
            on_progress(reported)
            if outcome is not None:
                yield outcome
    finally:
        for slot in slots:
            slot.stop()
        for slot in slots:
            slot.join()


class _Slot:
    """A thread with its own process, which runs one job after the other."""

    def __init__(
        self, todo: SimpleQueue[Job], done: SimpleQueue[Outcome], run: Run,
    ) -> None:
        self._todo = todo
        self._done = done
        self._run = run
        self._cells: Any = RawArray('q', 3)
        self._pool: ProcessPoolExecutor | None = None
        self._thread = Thread(target=self._work, name='replay slot', daemon=True)
        self._thread.start()

    @property
    def fraction(self) -> float:
        """Return the finished share of the current job."""
        expected = self._cells[_EXPECTED]
        return min(self._cells[_DONE] / expected, 0.99) if expected else 0.0

    def stop(self) -> None:
        """Stop the current job at the next frame, and start no other."""
        self._cells[_STOP] = 1

    def join(self) -> None:
        """Wait until the process has ended."""
        self._thread.join()

    def _work(self) -> None:
        try:
            while not self._cells[_STOP]:
                try:
                    job = self._todo.get_nowait()
                except Empty:
                    return
                outcome = self._attempts(job)
                self._cells[_EXPECTED] = 0
                self._done.put(outcome)
        finally:
            if self._pool is not None:
                self._pool.shutdown()

    def _attempts(self, job: Job) -> Outcome:
        for _ in range(ATTEMPTS):
            try:
                return self._executor().submit(_in_worker, self._run, job).result()
            except BrokenProcessPool:
                self._pool = None
            # The job or its outcome cannot be transferred.
            except Exception as error:
                return failure(job, f'{type(error).__name__}: {error}')
        return failure(
            job, f'its process has died {ATTEMPTS} times: it was killed, or ran out of memory')

    def _executor(self) -> ProcessPoolExecutor:
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                1, mp_context=get_context('spawn'), initializer=_begin_worker,
                initargs=(self._cells,))
        return self._pool


class _Stopped(BaseException):
    """Leaves a job, past all error handlers."""


_cells: Any = None


def _begin_worker(cells: Any) -> None:
    """Prepare a worker process."""
    global _cells
    _cells = cells
    # The parent process decides when to stop, and signals it in the shared memory. A terminal
    # sends its signals to all processes.
    for number in STOPPING:
        signal.signal(number, signal.SIG_IGN)
    Thread(target=_follow_parent, daemon=True).start()
    cv2.setNumThreads(1)


def _follow_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _in_worker(run: Run, job: Job) -> Outcome:
    def progress(done: int, expected: int | None) -> None:
        _cells[_DONE] = done
        _cells[_EXPECTED] = expected or 0
        if _cells[_STOP]:
            raise _Stopped

    try:
        return run(job, progress)
    except _Stopped:
        return failure(job, 'stopped')
