# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Runs the replays of a batch on any executor of concurrent.futures.

The rules are the same for processes of this machine and for a cluster: a replay that fails, or
whose process dies twice, is a row of the summary; when the batch is stopped, running replays stop
at their next frame and what is complete is kept. The engine and its jobs know of each other by
notes in the folder that they share.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, FIRST_COMPLETED, Future, wait
from contextlib import suppress
from pathlib import Path
import shutil
import time
from uuid import uuid4

from phase_traj_ros.io.outputs.commit import uninterrupted, writing_to
from phase_traj_ros.io.outputs.outputs import remove_abandoned, STAGING
from phase_traj_ros.tasks.batch.job import ReplayRequest
from phase_traj_ros.tasks.batch.outcome import failure, Outcome, Progress, run_request, Status

ATTEMPTS = 2
"""How often a replay is tried if its process dies."""

_POLL_S = 0.1
# A replay stops within a frame; a source on a network drive may hang.
_STOP_S = 30.0
# Seconds between two notes of the progress of a job.
_PERIOD_S = 0.1

Run = Callable[[ReplayRequest, Progress], Outcome]


class Stopped(BaseException):
    """The batch is over; leaves a job, past all error handlers."""


class Note:
    """How often a job has begun, and its progress. The batch is over when the folder is gone."""

    def __init__(self, folder: Path, job: int) -> None:
        """Note in ``folder`` as the job of this number."""
        self._begun = folder / f'{job}.begun'
        self._done = folder / f'{job}.done'
        self._due = 0.0

    def begin(self) -> int:
        """
        Note that the job begins; return how often it had begun before.

        Raises
        ------
        Stopped
            The batch is over.

        """
        try:
            with self._begun.open('ab') as file:
                file.write(b'.')
                return file.tell() - 1
        except FileNotFoundError:
            raise Stopped from None

    def __call__(self, done: int, expected: int | None) -> None:
        """
        Take the number of frames done and expected, and note the share a few times a second.

        Raises
        ------
        Stopped
            The batch is over.

        """
        now = time.monotonic()
        if now < self._due and done + 1 != expected:
            return
        self._due = now + _PERIOD_S
        try:
            self._done.write_text(str(min(done / expected, 0.99) if expected else 0.0))
        except FileNotFoundError:
            raise Stopped from None
        except OSError:
            # A full disk shows no progress; the job will fail by itself.
            pass

    def fraction(self) -> float:
        """Return the finished share of the job while it is being run."""
        try:
            return float(self._done.read_text())
        except (OSError, ValueError):
            return 0.0


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
        self._futures: dict[Future[Outcome], int] = {}
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

        Raises
        ------
        OutputError
            The output folder cannot be made or written.

        """
        outputs = [request.output for request in self._requests if request.output is not None]
        # In the shared folder, so that jobs stop and report their progress in the same way in a
        # process of this machine and on another one.
        folder = outputs[0].parent / f'{STAGING}{uuid4().hex}'
        with writing_to(folder.parent):
            folder.mkdir(parents=True)
        notes = [Note(folder, number) for number in range(len(self._requests))]
        try:
            self._futures = {
                executor.submit(_work, self._run, request, note): number
                for number, (request, note) in enumerate(zip(self._requests, notes))}
            self._follow(notes, on_progress)
        except BaseException:
            with uninterrupted():
                self._stopping = True
                stop_jobs(folder)
                done, late = wait(self._futures, _STOP_S)
                self._take(done)
                for future in late:
                    future.cancel()
            raise
        finally:
            stop_jobs(folder)
            for output in outputs:
                remove_abandoned(output)
                with suppress(OSError):  # Only an empty folder is removed.
                    output.rmdir()

    def _follow(self, notes: Sequence[Note], on_progress: Callable[[float], object]) -> None:
        pending, reported = set(self._futures), 0.0
        while pending:
            done, pending = wait(pending, _POLL_S, return_when=FIRST_COMPLETED)
            self._take(done)
            running = sum(notes[self._futures[future]].fraction() for future in pending)
            reported = max(reported, len(notes) - len(pending) + running)
            on_progress(reported)

    def _take(self, done: set[Future[Outcome]]) -> None:
        for future in done:
            number = self._futures[future]
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


def stop_jobs(folder: Path) -> None:
    """Stop all jobs with notes in this folder at their next frame."""
    # Renamed first: a note that is written while the folder is emptied would keep it.
    ended = folder.with_name(f'{folder.name}-ended')
    with suppress(OSError):
        folder.rename(ended)
    shutil.rmtree(ended, ignore_errors=True)


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
