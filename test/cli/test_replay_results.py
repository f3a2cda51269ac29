# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The output of replay: bags, figures, reports, and many sources at once."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
import csv
import json
import os
import subprocess
import sys

import cv2
import numpy as np
from phase_traj_ros.cli.main import main
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight
from phase_traj_ros.synthetic.degradations import sensor_noise
from phase_traj_ros.tasks.batch import job
import pytest

PLAIN = {
    'chain_code.json', 'manifest.json', 'shifts.csv', 'trajectory.png', 'trajectory.tum'}
# What is rolled has shifts and does not turn, so these are results of the paper's rule.
PAPER = ('--threshold', '16')
PLACES = [0, 1, 31, 61, 62, 22, 23, 24]


def pictures(folder, places=PLACES):
    folder.mkdir(parents=True)
    rng = np.random.default_rng(1)
    texture = cv2.GaussianBlur(rng.integers(0, 256, (96, 160), dtype=np.uint8), (0, 0), 1.5)
    for index, place in enumerate(places):
        cv2.imwrite(str(folder / f'{index}.png'), sensor_noise(
            np.roll(texture, place, axis=1), sigma=1.0, seed=index))
    return folder


@pytest.fixture
def folder(tmp_path):
    return pictures(tmp_path / 'drive')


def run(*arguments):
    return main([str(each) for each in arguments])


def refused(capsys, *arguments):
    """Run a call that has to fail; return its only line of output."""
    assert run(*arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == '' and captured.err.count('\n') == 1
    return captured.err


def files_in(folder):
    return {path.name for path in folder.iterdir()}


def test_no_more_runs_are_printed_than_a_person_reads(tmp_path, capsys):
    # Turns and straights by turns.
    folder, pairs = pictures(tmp_path / 'drive', [20 * (i // 2) for i in range(122)]), 121
    output = tmp_path / 'out'
    assert run('replay', folder, *PAPER, '--output', output) == 0
    printed = next(
        line for line in capsys.readouterr().out.splitlines() if line.startswith('movement'))
    runs = printed.partition(': ')[2].split()
    assert f'({pairs})' in printed and runs[-1] == '...' and len(runs) == 51
    kept = json.loads((output / 'chain_code.json').read_text())['movement']
    told = [int(code) for each in runs[:-1] for code in each[0] * int(each[2:])]
    assert len(kept) == pairs > len(told) and kept[:len(told)] == told


def test_a_calibration_that_is_not_used_is_said(folder, capsys, monkeypatch):
    monkeypatch.setattr(job, 'known_lens', lambda *_: (None, 'its focal length is 0'))
    assert run('replay', folder, *PAPER) == 0
    assert 'warning: the calibration is not used: its focal length is 0' in capsys.readouterr().err


def test_everything_of_one_source(folder, tmp_path, capsys):
    output = tmp_path / 'out'
    pytest.importorskip('rosbags')
    assert run(
        'replay', folder, *PAPER, '--output', output, '--report', '--svg',
        '--bag-out', output / 'drive.mcap', '--bag-debug-images') == 0
    assert files_in(output) == PLAIN | {
        'report.html', 'trajectory.svg', 'drive.mcap'}
    assert f'written to {output / "drive.mcap"}' in capsys.readouterr().out
    # Its debug images can be replayed themselves.
    with open_source(output / 'drive.mcap') as source:
        assert len(list(source)) == len(PLACES) - 1


def rendered(folder, *seeds, seconds=1.5, covered=0):
    """
    Write the pictures of a straight drive for each seed, one after the other.

    The road of the first ``covered`` ones is covered.
    """
    folder.mkdir()
    plans = [
        plan_drive('straight', [Straight(seconds)], seed=seed,
                   camera=Camera.with_field_of_view(320, 240, 70)) for seed in seeds]
    for index, frame in enumerate(frame for plan in plans for frame in render_drive(plan)):
        if index < covered:
            frame[130:] = 90
        cv2.imwrite(str(folder / f'{index:02}.png'), frame)


def test_a_cut_to_a_new_scene_is_said(tmp_path, capsys):
    rendered(tmp_path / 'film', 8, 3)
    assert run('replay', tmp_path / 'film', '-p', 'hfov_deg:=70.0') == 0
    assert 'warning: cuts to a new scene: 1\n' in capsys.readouterr().err


def test_a_distance_says_that_the_camera_is_assumed(tmp_path, capsys):
    rendered(tmp_path / 'drive', 8)
    printed, reports = [], []
    for camera in ((), ('-p', 'hfov_deg:=70.0')):
        assert run(
            'replay', tmp_path / 'drive', '--output', tmp_path / 'out', '--report', *camera) == 0
        printed.append(capsys.readouterr().out)
        reports.append((tmp_path / 'out' / 'report.html').read_text())
    assert ' camera heights for the assumed camera (pairs: ' in printed[0]
    assert 'the distance is for the assumed one' in reports[0]
    assert '<p>Camera: field of view 75 degrees' in reports[0]
    assert ' camera heights (pairs: ' in printed[1]
    assert 'the assumed one' not in reports[1]
    assert '<p>Camera: field of view 70 degrees' in reports[1]


@pytest.mark.parametrize('covered', [31, 15])
def test_an_unknown_distance_is_said_and_not_zero(covered, tmp_path, capsys):
    rendered(tmp_path / 'drive', 8, seconds=3.0, covered=covered)
    assert run('replay', tmp_path / 'drive', '--output', tmp_path / 'out') == 0
    printed = capsys.readouterr()
    content = json.loads((tmp_path / 'out' / 'chain_code.json').read_text())
    seen = covered < 31
    assert ('\ndistance: unknown (pairs: ' in printed.out) != seen
    assert (content['distance'] is None) != seen
    # Without lengths, the path has steps.
    unknown = content['distance_states']['unknown']
    warning = f'pairs of unknown distance, which are not counted: {unknown}\n'
    assert content['path_unit'] == ('camera heights' if seen else 'step')
    assert unknown > 10 and (warning in printed.err) == seen


def test_obsolete_results_are_removed(tmp_path):
    output = tmp_path / 'out'
    turning, straight = pictures(tmp_path / 'a'), pictures(tmp_path / 'b', [0, 0, 0, 0])
    assert run('replay', turning, *PAPER, '--output', output, '--report', '--svg') == 0
    (output / 'notes.txt').touch()
    assert run('replay', straight, *PAPER, '--output', output) == 0
    assert files_in(output) == PLAIN | {'notes.txt'}


def test_an_error_leaves_nothing_behind(folder, tmp_path, capsys):
    (folder / '5.png').write_bytes(b'')
    output = tmp_path / 'out'
    refused(
        capsys, 'replay', folder, '--strict', '--output', output, '--report', '--bag-out',
        tmp_path / 'bags' / 'x.mcap')
    assert files_in(tmp_path) == {'drive'}


@pytest.mark.parametrize(('arguments', 'message'), [
    (['--report'], 'report writes into the output folder'),
    (['--svg'], 'svg writes into the output folder'),
    (['--bag-out', 'x.bag'], 'its name has to end in .mcap'),
    (['--bag-debug-images'], 'bag_debug_images needs a bag to write them to'),
    (['{folder}'], 'several sources need --output DIR'),
    (['{folder}', '--output', '{out}', '--bag-out', 'a/x.mcap'], 'a name without a folder'),
    (['{folder}', '--output', '{out}', '--bag-out', 'x.bag'], 'has to end in .mcap'),
    (['{folder}', '--output', '{out}', '--jobs', '0'], "'0' does not fit: give 1 or more"),
    (['{folder}', '--output', '/dev/null'], 'cannot write to'),
])
def test_contradicting_options(folder, tmp_path, capsys, arguments, message):
    filled = [each.format(folder=folder, out=tmp_path / 'out') for each in arguments]
    assert message in refused(capsys, 'replay', folder, *filled)
    assert files_in(tmp_path) == {'drive'}


def test_several_sources_one_of_them_broken(tmp_path):
    pytest.importorskip('rosbags')
    sources = [pictures(tmp_path / name) for name in ('a', 'b')]
    broken = tmp_path / 'broken.mp4'
    broken.write_bytes(b'this is no video' * 100)
    output = tmp_path / 'out'
    # From a shell, because the processes import the main module of the program.
    result = subprocess.run(
        [sys.executable, '-m', 'phase_traj_ros.cli.main', 'replay', sources[0], broken,
         sources[1], '--jobs', '2', '--output', output, '--report', '--bag-out', 'codes.mcap',
         '--threshold', '20'],
        capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    assert (result.returncode, result.stderr) == (1, '')
    assert files_in(output) == {'a', 'b', 'manifest.json', 'summary.csv', 'summary.html'}
    for name in ('a', 'b'):
        assert files_in(output / name) == PLAIN | {'report.html', 'codes.mcap'}
        assert json.loads((output / name / 'chain_code.json').read_text())['threshold'] == 20
    with (output / 'summary.csv').open(newline='') as file:
        rows = list(csv.DictReader(file))
    assert [(row['folder'], row['status'], row['frames'], row['turns']) for row in rows] == [
        ('a', 'ok', '8', '2'), ('broken', 'failed', '0', '0'), ('b', 'ok', '8', '2')]
    assert 'is a text file, not a video' in rows[1]['error']
    assert rows[0]['source'] == str(sources[0])
    assert f'{broken}: failed: ' in result.stdout
    assert f'{sources[1]}: 8 frames, 2 turns' in result.stdout


def test_an_interruption_keeps_what_is_done(tmp_path, monkeypatch, capsys, handlers):
    from phase_traj_ros.tasks.batch.engine import Batch
    sources = [pictures(tmp_path / name) for name in ('a', 'b')]
    take = Batch._take

    def interrupted(batch, done):
        take(batch, done)
        if done and not batch._stopping:
            raise KeyboardInterrupt

    monkeypatch.setattr(Batch, '_take', interrupted)
    assert run('replay', *sources, '--output', tmp_path / 'out', '--jobs', '1') == 130
    with (tmp_path / 'out' / 'summary.csv').open(newline='') as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        complete = (tmp_path / 'out' / row['folder'] / 'chain_code.json').exists()
        assert row['status'] == ('ok' if complete else 'interrupted')
    assert 'ok' in {row['status'] for row in rows}
    assert 'interrupted' in capsys.readouterr().err


def test_without_a_cluster_nothing_is_created(folder, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, 'distributed', None)
    message = refused(
        capsys, 'replay', folder, '--output', tmp_path / 'out', '--dask', 'tcp://127.0.0.1:9')
    assert 'phase_traj_ros[dask]' in message
    assert files_in(tmp_path) == {'drive'}


def test_a_batch_that_fails_leaves_what_another_program_has_written(
        folder, tmp_path, capsys, monkeypatch):
    output = tmp_path / 'out'

    def no_cluster(*_, **__):
        output.mkdir()
        (output / 'of another').touch()
        raise ParameterError('no scheduler')

    monkeypatch.setattr('phase_traj_ros.cli.commands.replay_many.dask_executor', no_cluster)
    message = refused(capsys, 'replay', folder, '--output', output, '--dask', 'tcp://127.0.0.1:9')
    assert 'no scheduler' in message
    assert files_in(output) == {'of another'}


def test_a_worker_of_a_cluster_finds_the_mask(folder, tmp_path, monkeypatch):
    """It runs in another working directory."""
    (tmp_path / 'worker').mkdir()
    cv2.imwrite(str(tmp_path / 'mask.png'), np.full((96, 160), 255, np.uint8))

    @contextmanager
    def cluster(_):
        with ThreadPoolExecutor(1, initializer=os.chdir, initargs=('worker',)) as executor:
            yield executor

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr('phase_traj_ros.cli.commands.replay_many.dask_executor', cluster)
    assert run('replay', folder, '--output', 'out', '-p', 'mask_file:=mask.png',
               '--dask', 'tcp://127.0.0.1:9') == 0
