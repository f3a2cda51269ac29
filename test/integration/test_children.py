# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Nodes that a test or the demo starts do not outlive it."""

import fcntl
import os
from pathlib import Path
import subprocess
import sys

# Starts a node as a test does, and says which process it is.
TEST = """
from live import Live
from pathlib import Path
import sys
with Path(sys.argv[1]).open('w') as lock:
    import fcntl
    fcntl.flock(lock, fcntl.LOCK_EX)
    with Live(Path(sys.argv[1]).parent, lock=lock) as live:
        print(live.start(lossless=False).pid, flush=True)
        sys.stdin.read()
"""


def lives(pid):
    try:
        return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0] != 'Z'
    except FileNotFoundError:
        return False


def is_free(lock):
    with lock.open('w') as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
    return True


def test_a_killed_run_leaves_no_node_and_frees_its_domain_after_it(live, tmp_path):
    lock = tmp_path / 'lock'
    run = subprocess.Popen(
        [sys.executable, '-c', TEST, str(lock)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)})
    node = int(run.stdout.readline())
    held = Path(f'/proc/{node}/fd')
    assert any(each.resolve() == lock for each in held.iterdir())
    assert lives(node) and not is_free(lock)
    run.kill()
    run.communicate()
    live.until(lambda: not lives(node))
    assert is_free(lock)
