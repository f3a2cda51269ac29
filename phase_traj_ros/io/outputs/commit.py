# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Moves a set of files to their places, all of them or none."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, ExitStack, suppress
from dataclasses import dataclass
import os
from pathlib import Path
import signal
import threading

from phase_traj_ros.errors import OutputError

STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that end a program in order."""


@dataclass(frozen=True, slots=True)
class Move:
    """A change to one place: a file or folder replaces what is there, or that is removed."""

    staged: Path | None
    """What to put there; None to remove what is there."""
    target: Path
    aside: Path
    """Where to put what is there; on the same file system."""


@contextmanager
def writing_to(target: Path) -> Iterator[None]:
    """
    Convert errors of the operating system to an OutputError that names ``target``.

    Raises
    ------
    OutputError
        An operation of the operating system failed.

    """
    try:
        yield
    except OSError as error:
        raise OutputError(
            f'cannot write to {target}: {error.strerror or error}: choose another place') from None


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Delay the signals that stop the program to the end of the block, in the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    handlers = {
        number: signal.signal(number, lambda number, _: came.append(number))
        for number in STOPPING if signal.getsignal(number) not in (None, signal.SIG_IGN)}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if came:
            signal.raise_signal(came[0])


def commit(moves: Iterable[Move]) -> None:
    """
    Carry out all moves; if one fails, take the others back.

    Each file is replaced in one step, so a reader finds either the old or the new one.

    Raises
    ------
    OutputError
        A file cannot be moved to its place. Everything is as before.

    """
    with ExitStack() as undo:
        for move in moves:
            with writing_to(move.target):
                _carry_out(move, undo)
        undo.pop_all()


def _carry_out(move: Move, undo: ExitStack) -> None:
    if os.path.lexists(move.target):
        if move.staged is None or not _linked(move.target, move.aside):
            move.target.rename(move.aside)
        undo.callback(_move_back, move.aside, move.target)
    if move.staged is not None:
        move.staged.replace(move.target)
        undo.callback(_move_back, move.target, move.staged)


def _move_back(path: Path, origin: Path) -> None:
    with suppress(OSError):
        path.replace(origin)


def _linked(path: Path, other: Path) -> bool:
    """Return whether ``other`` has become a second name of a file; not on every file system."""
    try:
        os.link(path, other, follow_symlinks=False)
    except OSError:
        return False
    return True
