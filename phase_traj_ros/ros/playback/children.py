# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Starts processes that do not outlive the process that started them."""

import ctypes
import signal
import subprocess
import sys
from typing import Any

_PR_SET_PDEATHSIG = 1


def start_child(arguments: list[str], **options: Any) -> 'subprocess.Popen[Any]':
    """
    Start a process as ``subprocess.Popen`` does; on Linux, it dies with the calling thread.

    However the calling process ends, also killed, no node of its own remains on the network.
    """
    if sys.platform == 'linux':
        # Looked up here: between fork and exec, little is allowed.
        prctl = ctypes.CDLL(None).prctl
        options['preexec_fn'] = lambda: prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    return subprocess.Popen(arguments, **options)
