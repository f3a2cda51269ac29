# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The demo, and the paper's case studies as drives."""

import json
import subprocess
import sys

from phase_traj_ros.io import open_source
import pytest


@pytest.mark.parametrize(('drive', 'frames', 'directions', 'movements'), [
    ('demo', 201, [1, 0, 1, 0], [1, 0, 3, 1, 2, 3, 1, 0, 3, 1]),
    ('paper_case_1', 241, [1, 2, 3], [1, 2, 3, 1, 2, 3, 1]),
    ('paper_case_2', 200, [1, 0, 1, 2], [1, 0, 3, 1, 2, 3, 1, 2, 3, 1]),
])
def test_demo(tmp_path, drive, frames, directions, movements):
    pytest.importorskip('rosbags')
    output = tmp_path / 'out'
    run = subprocess.run(
        [sys.executable, '-m', 'phase_traj_ros.cli.main', 'demo', '--drive', drive, '--output',
         str(output)], capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    assert run.returncode == 0, run.stderr
    assert 'live and offline codes are the same' in run.stdout
    code = json.loads((output / 'chain_code.json').read_text())
    assert (code['frames'], len(code['movement'])) == (frames, frames - 1)
    assert [run[0] for run in code['direction_runs']] == directions
    assert [run[0] for run in code['movement_runs']] == movements
    assert {path.name for path in output.iterdir()} == {
        'chain_code.json', 'manifest.json', 'shifts.csv', 'trajectory.png', 'trajectory.tum',
        f'{drive}_bag'}
    with open_source(output / f'{drive}_bag') as source:
        assert source.frame_count == frames
