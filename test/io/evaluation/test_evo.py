# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Trajectory files in evo (https://github.com/MichaelGrupp/evo), where that is installed."""

import math
import shutil
import subprocess
import sys

import numpy as np
from phase_traj_ros.cli.main import main
from phase_traj_ros.synthetic import named_drive, write_drive_bag
import pytest


@pytest.fixture(scope='module')
def drive():
    """Return the demo's drive up to the end of its second turn; skip without evo."""
    pytest.importorskip('evo')
    return named_drive('demo').take(range(135))


@pytest.fixture(scope='module')
def results(drive, tmp_path_factory):
    """Return the folder of a replay in metres, with the truth as truth.tum."""
    folder = tmp_path_factory.mktemp('evo')
    write_drive_bag(drive, folder / 'bag')
    params = folder / 'params.yaml'
    params.write_text(
        '/**:\n  ros__parameters:'
        ' {code_source: heading, path_from: heading, use_speed_topic: true}\n')
    assert main([
        'replay', str(folder / 'bag'), '--params', str(params), '--output',
        str(folder / 'out')]) == 0
    with (folder / 'truth.tum').open('w', encoding='utf-8') as file:
        for stamp, (x, y, yaw) in zip(drive.stamps_ns.tolist(), drive.poses[:, :3].tolist()):
            sine, cosine = math.sin(yaw / 2), math.cos(yaw / 2)
            file.write(f'{stamp / 1e9:.6f} {x} {y} 0 0 0 {sine} {cosine}\n')
    return folder


def test_evo_reads_every_pose(drive, results):
    from evo.tools import file_interface
    trajectory = file_interface.read_tum_trajectory_file(str(results / 'out' / 'trajectory.tum'))
    assert trajectory.check()[0], trajectory.check()[1]
    assert trajectory.num_poses == len(drive)
    assert trajectory.timestamps == pytest.approx(drive.stamps_ns / 1e9, abs=1e-6)
    true = drive.poses[:, :2] - drive.poses[0, :2]
    assert trajectory.path_length == pytest.approx(
        np.hypot(*np.diff(true, axis=0).T).sum(), rel=0.01)


def test_evo_measures_it_against_the_truth(results):
    from evo.core import metrics, sync
    from evo.tools import file_interface
    truth, found = sync.associate_trajectories(
        file_interface.read_tum_trajectory_file(str(results / 'truth.tum')),
        file_interface.read_tum_trajectory_file(str(results / 'out' / 'trajectory.tum')))
    found.align(truth)
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((truth, found))
    assert error.get_statistic(metrics.StatisticsType.rmse) < 0.01 * truth.path_length
    turned = metrics.APE(metrics.PoseRelation.rotation_angle_deg)
    turned.process_data((truth, found))
    assert turned.get_statistic(metrics.StatisticsType.max) < 3.0


def test_evo_traj_opens_it(drive, results, tmp_path):
    program = shutil.which('evo_traj', path=str(sys.prefix) + '/bin')
    assert program is not None
    run = subprocess.run(
        [program, 'tum', str(results / 'out' / 'trajectory.tum'), '--ref',
         str(results / 'truth.tum'), '--align'],
        capture_output=True, text=True, check=False,
        env={'HOME': str(tmp_path), 'PATH': '/usr/bin:/bin', 'MPLBACKEND': 'Agg'})
    assert run.returncode == 0, run.stderr
    assert f'{len(drive)} poses' in run.stdout
