# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Converts SIGINT, SIGTERM and SIGHUP to an event, from the start of the process to its end.

The imports of this module are fast, so that an executable can call it first.
"""

from collections.abc import Iterator
from contextlib import contextmanager
import signal
from threading import Event


@contextmanager
def stop_on_signals() -> Iterator[Event]:
    """
    Yield the event that SIGINT, SIGTERM and SIGHUP set.

    Once it is set, further signals are ignored, even after the block: the process is ending, and
    a second Ctrl-C must not turn this into a failure.
    """
    stop = Event()
    numbers = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # As nohup does.
        numbers.append(signal.SIGHUP)

    def ignore(*_: object) -> None:
        """Do nothing; for SIG_IGN, Python reports an error if a signal has already arrived."""

    def end(*_: object) -> None:
        # An event is not re-entrant: a signal while it is set would wait for its lock for ever.
        for number in numbers:
            signal.signal(number, ignore)
        stop.set()

    handlers = {number: signal.signal(number, end) for number in numbers}
    try:
        yield stop
    finally:
        for number, handler in handlers.items():
            # At exit, Python resets handlers that are functions, but not SIG_IGN.
            signal.signal(number, signal.SIG_IGN if stop.is_set() else handler)
