# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Trajectory files and errors against evo (https://github.com/MichaelGrupp/evo)."""

import json
import math
import shutil
import subprocess
import sys

import numpy as np
from phase_traj_ros.cli.main import main
from phase_traj_ros.synthetic import write_drive_bag
from phase_traj_ros.tasks.evaluation.scores import absolute_error, relative_errors
import pytest
from smaller import half_demo


@pytest.fixture(scope='module')
def drive():
    """Return the demo's drive up to the end of its second turn; skip without evo."""
    pytest.importorskip('evo')
    return half_demo(135)


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


@pytest.fixture(scope='module')
def apart():
    """Return a true path (n, 3) of 950 m with bends and stops, and one that drifts off it."""
    rng = np.random.default_rng(12)
    lengths = np.clip(1.0 + rng.normal(0, 0.2, 1000).cumsum() * 0.1, 0.0, 2.5)
    lengths *= 950 / lengths.sum()
    yaws = np.radians(rng.normal(0, 0.5, 1000) + 3.0 * (np.arange(1000) // 30 % 7 == 3))
    found = _poses(
        1.03 * lengths * rng.normal(1, 0.05, 1000), yaws + np.radians(rng.normal(0.01, 0.1, 1000)))
    return _poses(lengths, yaws), found


@pytest.mark.parametrize('scaled', [True, False])
def test_absolute_errors_are_evos(apart, scaled):
    true, found = apart
    assert absolute_error(found[:, :2], true[:, :2], scaled=scaled) == pytest.approx(
        _ape(_trajectory(true), _trajectory(found), scaled=scaled))


def test_relative_errors_are_evos(apart):
    """The parts are those of KITTI's own program, the error of each is that of evo."""
    from evo.core import lie_algebra
    from evo.core.metrics import RPE
    true, found = (_trajectory(side).poses_se3 for side in apart)
    places = np.array([pose[:3, 3] for pose in true])
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    shifts, turns = [], []
    for start in range(0, len(true), 10):
        for length in range(100, 900, 100):
            end = next((at for at in range(start, len(true)) if way[at] > way[start] + length), 0)
            if not end:
                continue
            off = RPE.rpe_base(true[start], true[end], found[start], found[end])
            shifts.append(np.linalg.norm(off[:3, 3]) / (way[end] - way[start]))
            turns.append(lie_algebra.so3_log_angle(off[:3, :3]) / (way[end] - way[start]))
    errors = relative_errors(apart[1], apart[0])
    assert len(shifts) > 300
    assert errors.translation == pytest.approx(np.mean(shifts))
    assert errors.rotation == pytest.approx(np.mean(turns))


def test_evaluate_agrees_with_evo(results):
    from evo.core import sync
    from evo.tools import file_interface
    truth = results / 'truth.tum'
    assert main(['evaluate', str(results / 'out'), '--ground-truth', str(truth)]) == 0
    told = json.loads((results / 'out' / 'evaluation.json').read_text())
    pair = sync.associate_trajectories(
        file_interface.read_tum_trajectory_file(str(truth)),
        file_interface.read_tum_trajectory_file(str(results / 'out' / 'trajectory.tum')))
    assert told['ate_m'] == pytest.approx(_ape(*pair, scaled=False), rel=1e-3)
    assert told['ate_scaled_m'] == pytest.approx(_ape(*pair, scaled=True), rel=1e-3)
    assert told['distance_error_percent'] == pytest.approx(
        100 * (pair[1].path_length / pair[0].path_length - 1), abs=1e-3)
    assert abs(told['distance_error_percent']) < 1.0
    assert 0.0 < told['t_rel_percent'] < 2.0 and 0.0 < told['r_rel_deg_per_100m'] < 2.0


def test_a_truth_of_a_part_says_how_much_it_covers(results, capsys):
    truth = results / 'part.tum'
    poses = (results / 'truth.tum').read_text().splitlines(keepends=True)
    truth.write_text(''.join(poses[:40]))
    assert main(['evaluate', str(results / 'out'), '--ground-truth', str(truth)]) == 0
    frames = len((results / 'out' / 'trajectory.tum').read_text().splitlines())
    assert f'40 of {frames} frames, ' in capsys.readouterr().out


def _poses(lengths, yaws):
    yaw = np.concatenate([[0.0], np.cumsum(yaws)])
    steps = np.stack([lengths * np.cos(yaw[1:]), lengths * np.sin(yaw[1:])], axis=1)
    return np.column_stack([np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)]), yaw])


def _trajectory(poses):
    from evo.core.trajectory import PoseTrajectory3D
    x, y, yaw = poses.T
    zero = np.zeros(len(poses))
    return PoseTrajectory3D(
        positions_xyz=np.column_stack([x, y, zero]),
        orientations_quat_wxyz=np.column_stack([np.cos(yaw / 2), zero, zero, np.sin(yaw / 2)]),
        timestamps=np.arange(len(poses)) / 10)


def _ape(truth, found, *, scaled):
    """Return evo's absolute error of the places; evo aligns in three dimensions."""
    from copy import deepcopy

    from evo.core import metrics
    fitted = deepcopy(found)
    fitted.align(truth, correct_scale=scaled)
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((truth, fitted))
    return error.get_statistic(metrics.StatisticsType.rmse)
