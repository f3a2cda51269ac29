# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
SIGINT and SIGTERM as an event, from the first moment to the last.

Imports nothing that takes time, so that an executable can call it before all else.
"""

from collections.abc import Iterator
from contextlib import contextmanager
import signal
from threading import Event


@contextmanager
def stop_on_signals() -> Iterator[Event]:
    """
    Yield the event that SIGINT and SIGTERM set.

    Once it is set, further signals change nothing, even after the block: the process is on its
    way out, and a second Ctrl-C must not turn that into a failure.
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
            # Python itself resets handlers that are functions at its end, but not this one.
            signal.signal(number, signal.SIG_IGN if stop.is_set() else handler)
