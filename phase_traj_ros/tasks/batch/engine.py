# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Runs the replays of a batch on any executor of concurrent.futures.

The rules are the same for processes of this machine and for a cluster: a replay that fails, or
whose process dies twice, is a row of the summary; when the batch is stopped, running replays stop
at their next frame and what is complete is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, FIRST_COMPLETED, Future, wait
from contextlib import suppress
from pathlib import Path
from typing import Final

from phase_traj_ros.io.outputs.commit import uninterrupted
from phase_traj_ros.io.outputs.outputs import remove_abandoned
from phase_traj_ros.tasks.batch.notes import folder_of_notes, Note, stop_jobs, Stopped
from phase_traj_ros.tasks.batch.outcome import failure, Outcome, Progress, run_request, Status
from phase_traj_ros.tasks.batch.request import ReplayRequest

ATTEMPTS: Final = 2
"""How often a replay is tried if its process dies."""

_POLL_S = 0.1
# A replay stops within a frame; a source on a network drive may hang.
_STOP_S = 30.0

Run = Callable[[ReplayRequest, Progress], Outcome]


class Batch:
    """The replays of a batch and their outcomes."""

    def __init__(self, requests: Sequence[ReplayRequest], *, run: Run = run_request) -> None:
        """
        Keep the requests, as ``batch_of`` made them.

        ``run`` runs one; a function that other processes can import.
        """
        self._requests = tuple(requests)
        self._run = run
        self._stopping = False
        self.rows = [
            failure(request, 'not done', status=Status.INTERRUPTED) for request in requests]
        """All outcomes, in the order of the requests."""

    def run(
        self, executor: Executor, on_progress: Callable[[float], object] = lambda done: None,
    ) -> None:
        """
        Run all replays; return when each has an outcome.

        After an exception, such as that of a signal, the running replays are stopped, and
        ``rows`` tells which are complete.

        Parameters
        ----------
        executor
            Runs the replays. Its processes share the output folder with this one.
        on_progress
            Called several times a second with the number of finished replays, including
            fractions. The number never decreases, also when a replay starts again.

        """
        output = self._requests[0].output
        assert output is not None
        with folder_of_notes(output.parent) as folder:
            notes = [Note(folder, number) for number in range(len(self._requests))]
            futures = {
                executor.submit(_work, self._run, request, note): number
                for number, (request, note) in enumerate(zip(self._requests, notes))}
            try:
                self._follow(futures, notes, on_progress)
            except BaseException:
                with uninterrupted():
                    self._stop(futures, folder)
                raise
            finally:
                for request in self._requests:
                    assert request.output is not None
                    remove_abandoned(request.output)
                    with suppress(OSError):  # Only an empty folder is removed.
                        request.output.rmdir()

    def _follow(
        self, futures: dict[Future[Outcome], int], notes: Sequence[Note],
        on_progress: Callable[[float], object],
    ) -> None:
        pending, reported = set(futures), 0.0
        while pending:
            done, pending = wait(pending, _POLL_S, return_when=FIRST_COMPLETED)
            self._take(done, futures)
            running = sum(notes[futures[future]].fraction() for future in pending)
            reported = max(reported, len(futures) - len(pending) + running)
            on_progress(reported)

    def _stop(self, futures: dict[Future[Outcome], int], folder: Path) -> None:
        self._stopping = True
        stop_jobs(folder)
        done, late = wait(futures, _STOP_S)
        self._take(done, futures)
        for future in late:
            future.cancel()

    def _take(
        self, done: set[Future[Outcome]], futures: dict[Future[Outcome], int],
    ) -> None:
        for future in done:
            number = futures[future]
            if not (self._stopping and future.cancelled()):
                self.rows[number] = self._outcome(future, self._requests[number])

    def _outcome(self, future: Future[Outcome], request: ReplayRequest) -> Outcome:
        if future.cancelled():
            return failure(request, 'lost: the scheduler of the cluster has ended')
        error = future.exception()
        if error is not None:
            return failure(request, f'{type(error).__name__}: {error}')
        outcome = future.result()
        if outcome.status is Status.INTERRUPTED and not self._stopping:
            return failure(
                request, 'the machine that ran it does not have the output folder: the machines'
                ' of a cluster have to share it')
        return outcome


def _work(run: Run, request: ReplayRequest, note: Note) -> Outcome:
    """Run a replay in a worker."""
    try:
        if note.begin() >= ATTEMPTS:
            return failure(
                request, f'its process has died {ATTEMPTS} times: it was killed, or ran out of'
                ' memory')
        return run(request, note)
    except Stopped:
        return failure(request, 'not done', status=Status.INTERRUPTED)
