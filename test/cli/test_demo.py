# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj demo``, with and without a map, against the true drive."""

import json
import re

from phase_traj_ros.cli.main import main
from phase_traj_ros.io import open_source
import pytest


@pytest.mark.integration
def test_the_demo_has_the_true_turns(tmp_path, capsys):
    pytest.importorskip('rosbags')
    output = tmp_path / 'out'
    assert main(['demo', '--output', str(output)]) == 0

    lines = capsys.readouterr().out.splitlines()
    [found, true] = [line.split(': ')[1] for line in lines if 'turns ' in line or 'turns:' in line]
    assert true == 'left 90, right 90, left 90'
    assert found == f'{true} (degrees)'
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


@pytest.mark.integration
def test_the_demo_is_found_on_its_map(tmp_path, capsys):
    pytest.importorskip('rosbags')
    assert main(['demo', '--map', '--output', str(tmp_path / 'demo')]) == 0

    out = capsys.readouterr().out
    assert 'The place is known after' in out
    assert float(re.search(r'at most ([\d.]+) m off', out)[1]) < 15.0
    names = {path.name for path in (tmp_path / 'demo').iterdir()}
    assert names >= {'town.osm', 'town_bag', 'location.html', 'location.csv', 'chain_code.json'}
    content = json.loads((tmp_path / 'demo' / 'chain_code.json').read_text())
    assert content['location']['located'] and content['distance_unit'] == 'm'
