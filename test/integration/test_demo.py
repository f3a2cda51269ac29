# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The demo, live and offline."""

import json
import subprocess
import sys

from phase_traj_ros.io import open_source
import pytest


def test_demo(tmp_path):
    pytest.importorskip('rosbags')
    output = tmp_path / 'out'
    run = subprocess.run(
        [sys.executable, '-m', 'phase_traj_ros.cli.main', 'demo', '--output', str(output)],
        capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    assert run.returncode == 0, run.stderr
    assert 'live and offline codes are the same' in run.stdout
    assert 'WARN' not in run.stderr
    code = json.loads((output / 'chain_code.json').read_text())
    assert (code['frames'], len(code['movement'])) == (201, 200)
    assert [run[0] for run in code['direction_runs']] == [1, 0, 1, 0]
    assert [run[0] for run in code['movement_runs']] == [
        1, 3, 0, 3, 1, 3, 2, 3, 1, 3, 0, 3, 1]
    assert {path.name for path in output.iterdir()} == {
        'chain_code.json', 'manifest.json', 'shifts.csv', 'trajectory.png', 'trajectory.tum',
        'demo_bag'}
    with open_source(output / 'demo_bag') as source:
        assert source.frame_count == 201
