# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a running estimator keeps, on disk."""

import json

import numpy as np
from phase_traj_ros.core import EstimatorSettings, TrajectoryEstimator
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.results.files import Snapshot
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic.degradations import sensor_noise

TEXTURE = np.random.default_rng(0).integers(0, 256, (64, 100), dtype=np.uint8)


def driven(positions, **settings):
    estimator = TrajectoryEstimator(EstimatorSettings(**settings))
    for index, position in enumerate(positions):
        frame = sensor_noise(np.roll(TEXTURE, position, axis=1), sigma=1.0, seed=index)
        estimator.update(frame, index * 10**8)
    return estimator


def test_a_snapshot_stays_as_it_was(tmp_path):
    estimator = driven([0, 0, 30, 30])
    snapshot = Snapshot.of(estimator, Mounting(Parameters()), source='/camera')
    estimator.update(TEXTURE, 10**9)
    snapshot.write(tmp_path / 'kept')
    content = json.loads((tmp_path / 'kept' / 'chain_code.json').read_text())
    assert (content['source'], content['frames']) == ('/camera', 4)
    assert content['movement_runs'] == [[1, 1], [0, 1], [1, 1]]
    assert content['movement_totals'] == [1, 2, 0, 0]
    assert content['direction_totals'] == [2, 1, 0, 0]
    poses = np.loadtxt(tmp_path / 'kept' / 'trajectory.tum')
    assert poses[:, 1:3].tolist() == [[0, 0], [1, 0], [1, 2]]
    assert (tmp_path / 'kept' / 'trajectory.png').stat().st_size > 1000


def test_only_what_is_kept_is_written(tmp_path):
    Snapshot.of(
        driven([0, 0, 30, 30, 0, 0, 30, 30], max_runs=2, max_corners=2), Mounting(Parameters()),
        source='x').write(tmp_path)
    content = json.loads((tmp_path / 'chain_code.json').read_text())
    assert content['movement_runs'] == [[0, 1], [1, 1]]
    assert sum(content['movement_totals']) == 7
    assert len(np.loadtxt(tmp_path / 'trajectory.tum')) == 3


def test_nothing_yet_can_be_written_too(tmp_path):
    Snapshot.of(TrajectoryEstimator(), Mounting(Parameters()), source='x').write(tmp_path)
    assert json.loads((tmp_path / 'chain_code.json').read_text())['movement_runs'] == []
    assert (tmp_path / 'trajectory.tum').read_text() == ''
