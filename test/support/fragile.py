# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Jobs whose process is killed while they run; other processes import this."""

import os
from pathlib import Path
import signal
import time

from phase_traj_ros.tasks.batch.outcome import run_request

# Set by the process that starts the others, which inherit it.
VARIABLE = 'PHASE_TRAJ_TEST_KILLED'


def killed_once(job, progress):
    """Kill this process at the fifth frame of the source 'victim', the first time."""
    return run_request(job, _deadly(job, progress, always=False))


def killed_always(job, progress):
    """Kill this process at the fifth frame of the source 'victim', every time."""
    return run_request(job, _deadly(job, progress, always=True))


def endless(job, progress):
    """Stay at the fifth frame of the source 'endless' until the batch is over."""
    def step(done, expected):
        progress(done, expected)
        while job.source.name == 'endless' and done == 5:
            assert list(job.output.glob('.phase_traj-*'))
            progress(done, expected)
            time.sleep(0.01)

    return run_request(job, step)


def never_returns(job, progress):
    """Fail in a way that the outcome cannot report."""
    raise RuntimeError('a fault\nof two lines')


def _deadly(job, progress, *, always):
    def step(done, expected):
        marks = Path(os.environ[VARIABLE])
        if job.source.name == 'victim' and done == 5 and (always or not any(marks.iterdir())):
            # There must be unfinished output that could be left behind.
            assert list(job.output.glob('.phase_traj-*'))
            (marks / str(os.getpid())).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        progress(done, expected)

    return step
