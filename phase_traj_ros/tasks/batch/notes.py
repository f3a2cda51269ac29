# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Notes by which a batch and its jobs know of each other, through the folder that they share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
import shutil
import time

from phase_traj_ros.io.outputs.commit import writing_to
from phase_traj_ros.io.outputs.outputs import STAGING

_PERIOD_S = 0.1


class Stopped(BaseException):
    """The batch is over; leaves a job, past all error handlers."""


@dataclass(frozen=True, slots=True)
class Notes:
    """
    A folder of notes. The batch is over when it is gone.

    So jobs stop and report their progress in the same way in a process of this machine and on
    another one.
    """

    folder: Path

    @classmethod
    @contextmanager
    def in_folder(cls, root: Path, batch: str) -> Iterator[Notes]:
        """
        Make the folder of notes for the jobs of a batch; remove it at the end.

        Raises
        ------
        OutputError
            The folder ``root`` cannot be made or written.

        """
        notes = cls(root / f'{STAGING}{batch}notes')
        with writing_to(root):
            notes.folder.mkdir(parents=True)
        try:
            yield notes
        finally:
            notes.end()

    def end(self) -> None:
        """Stop all jobs at their next frame."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def begin(self, job: int) -> int:
        """
        Note that a job begins; return how often it had begun before.

        Raises
        ------
        Stopped
            The batch is over.

        """
        try:
            with (self.folder / f'{job}.begun').open('ab') as file:
                file.write(b'.')
                return file.tell() - 1
        except FileNotFoundError:
            raise Stopped from None

    def fraction(self, job: int) -> float:
        """Return the finished share of a job that is being run."""
        try:
            done, expected = map(int, (self.folder / f'{job}.done').read_text().split())
        except (OSError, ValueError):
            return 0.0
        return min(done / expected, 0.99) if expected else 0.0

    def write(self, job: int, done: int, expected: int | None) -> None:
        """
        Note the progress of a job.

        Raises
        ------
        Stopped
            The batch is over.

        """
        try:
            (self.folder / f'{job}.done').write_text(f'{done} {expected or 0}')
        except FileNotFoundError:
            raise Stopped from None
        except OSError:
            # A full disk shows no progress; the job will fail by itself.
            with suppress(OSError):
                (self.folder / f'{job}.done').unlink()


class Progress:
    """Notes the progress of a job, a few times a second."""

    def __init__(self, notes: Notes, job: int) -> None:
        """Write to ``notes`` as the job of that number."""
        self._notes = notes
        self._job = job
        self._due = 0.0

    def __call__(self, done: int, expected: int | None) -> None:
        """
        Take the number of frames done and expected.

        Raises
        ------
        Stopped
            The batch is over.

        """
        now = time.monotonic()
        if now >= self._due or done + 1 == expected:
            self._due = now + _PERIOD_S
            self._notes.write(self._job, done, expected)
