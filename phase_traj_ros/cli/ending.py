# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The ways in which the program ends other than by itself: signals, and closed outputs.

The imports of this module are fast, so that the program can call it first.
"""

from collections.abc import Callable
from contextlib import suppress
import os
import signal
import sys
from types import FrameType
from typing import TextIO

EXIT_BAD_INPUT = 2
"""Exit status after a wrong call, or an input that cannot be used."""

_WORDS = {signal.SIGINT: 'interrupted', signal.SIGTERM: 'terminated', signal.SIGHUP: 'hung up'}


class Ended(KeyboardInterrupt):
    """A signal has ended the program."""

    def __init__(self, number: int) -> None:
        """Keep the number of the signal."""
        super().__init__(number)
        self.number = number


def raise_ended(number: int, _: FrameType | None) -> None:
    """Handle a signal: leave the work in order."""
    raise Ended(number)


def leave_at_once(number: int, _: FrameType | None) -> None:
    """Handle a signal before there is any work; an import might hide an exception."""
    os.write(2, f'{line_of(number)}\n'.encode())
    os._exit(status_of(number))


def handle_signals(handler: signal.Handlers | Callable[[int, FrameType | None], None]) -> None:
    """Handle the signals that end a program, except those that the caller has it ignore."""
    for number in _WORDS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)


def status_of(number: int) -> int:
    """Return the exit status of a program that ends because of a signal."""
    return 128 + number


def line_of(number: int) -> str:
    """Return the line that tells the user of the signal."""
    return f'phase_traj: {_WORDS[signal.Signals(number)]}'


def open_closed_streams() -> None:
    """Open the standard streams that the caller has closed, so that no file takes their place."""
    for name, mode in (('stdin', 'r'), ('stdout', 'w'), ('stderr', 'w')):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding='utf-8'))  # noqa: SIM115


def write_error(stream: TextIO) -> OSError | None:
    """Return why a standard stream cannot be written, and close it; None if it can."""
    try:
        stream.flush()
    except OSError as error:
        # Nothing more must be written on exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        return error
    return None


def say(line: str) -> None:
    """Print a line to the standard error, if anyone reads it."""
    with suppress(OSError):
        print(line, file=sys.stderr, flush=True)
