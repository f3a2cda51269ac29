# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Notes by which a batch and its jobs know of each other, through the folder that they share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
import shutil
import time
from uuid import uuid4

from phase_traj_ros.io.outputs.commit import writing_to
from phase_traj_ros.io.outputs.outputs import STAGING

_PERIOD_S = 0.1


class Stopped(BaseException):
    """The batch is over; leaves a job, past all error handlers."""


@contextmanager
def folder_of_notes(root: Path) -> Iterator[Path]:
    """
    Make a folder for the notes of the jobs of a batch; remove it at the end, which stops them.

    So jobs stop and report their progress in the same way in a process of this machine and on
    another one.

    Raises
    ------
    OutputError
        The folder ``root`` cannot be made or written.

    """
    folder = root / f'{STAGING}{uuid4().hex}'
    with writing_to(root):
        folder.mkdir(parents=True)
    try:
        yield folder
    finally:
        stop_jobs(folder)


def stop_jobs(folder: Path) -> None:
    """Stop all jobs with notes in this folder at their next frame."""
    shutil.rmtree(folder, ignore_errors=True)


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
        Take the number of frames done and expected, and note them a few times a second.

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
            self._done.write_text(f'{done} {expected or 0}')
        except FileNotFoundError:
            raise Stopped from None
        except OSError:
            # A full disk shows no progress; the job will fail by itself.
            pass

    def fraction(self) -> float:
        """Return the finished share of the job while it is being run."""
        try:
            done, expected = map(int, self._done.read_text().split())
        except (OSError, ValueError):
            return 0.0
        return min(done / expected, 0.99) if expected else 0.0
