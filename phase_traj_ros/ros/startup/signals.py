# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Converts SIGINT and SIGTERM to an event, from the start of the process to its end.

The imports of this module are fast, so that an executable can call it first.
"""

from collections.abc import Iterator
from contextlib import contextmanager
import signal
from threading import Event


@contextmanager
def stop_on_signals() -> Iterator[Event]:
    """
    Yield the event that SIGINT and SIGTERM set.

    Once it is set, further signals are ignored, even after the block: the process is ending, and
    a second Ctrl-C must not turn this into a failure.
    """
    stop = Event()
    handlers = {
        number: signal.signal(number, lambda *_: stop.set())
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield stop
    finally:
        for number, handler in handlers.items():
            # At exit, Python resets handlers that are functions, but not SIG_IGN.
            signal.signal(number, signal.SIG_IGN if stop.is_set() else handler)
