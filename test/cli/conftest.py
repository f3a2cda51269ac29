# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Fixtures for the tests of the command line."""

import signal

from phase_traj_ros.io.outputs.commit import STOPPING
import pytest


@pytest.fixture
def handlers():
    """Restore the handlers of the signals, which ignore them once one has ended the program."""
    before = {number: signal.getsignal(number) for number in STOPPING}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)
