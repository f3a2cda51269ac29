# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The program from a user's point of view: files, one-line errors, exit status.

It runs in this process, except where the test is about the process; ``test_ending`` has the rest.
"""

import csv
from importlib.util import find_spec
import json
import os
import re
import subprocess
import sys

import cv2
import numpy as np
import phase_traj_ros
from phase_traj_ros.cli.main import main
from phase_traj_ros.core import unpack
from phase_traj_ros.core.correlation.transforms import find_transform
from phase_traj_ros.parameter_spec import Group
from phase_traj_ros.parameters import specs
from phase_traj_ros.synthetic.degradations import sensor_noise
import pytest

POSITIONS = [0, 0, 30, 60, 60, 20, 20, 20]
# What is rolled has shifts and does not turn, so these are the codes of the paper's rule.
PAPER = ('--threshold', '16')
MOVEMENT = [1, 0, 3, 1, 2, 1, 1]
DIRECTION = [1, 0, 0, 1, 1, 1]


@pytest.fixture
def folder(tmp_path):
    """Return a folder with eight pictures: a left turn, then a right turn."""
    path = tmp_path / 'pictures'
    path.mkdir()
    rng = np.random.default_rng(1)
    texture = cv2.GaussianBlur(rng.integers(0, 256, (96, 160), dtype=np.uint8), (0, 0), 1.5)
    for index, position in enumerate(POSITIONS):
        cv2.imwrite(str(path / f'{index}.png'), sensor_noise(
            np.roll(texture, position, axis=1), sigma=1.0, seed=index))
    return path


def in_a_process(*arguments):
    return subprocess.run(
        [sys.executable, '-m', 'phase_traj_ros.cli.main', *map(str, arguments)],
        capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)


@pytest.fixture
def run(capfd, monkeypatch):
    """Return a function that runs the program in this process, as a process would end."""
    def call(*arguments, cwd=None):
        with monkeypatch.context() as patch:
            if cwd is not None:
                patch.chdir(cwd)
            status = main([str(each) for each in arguments])
        return subprocess.CompletedProcess(arguments, status, *capfd.readouterr())
    return call


def checked(result):
    """Check that a call has failed in one line; return it."""
    assert result.returncode == 2, result
    assert result.stderr.count('\n') == 1, result.stderr
    assert 'Traceback' not in result.stderr
    assert result.stdout == ''
    return result.stderr


@pytest.fixture
def refused(run):
    """Return a function that runs a call that has to fail, and returns its only line."""
    return lambda *arguments: checked(run(*arguments))


def test_replay_writes_everything(run, folder, tmp_path):
    output = tmp_path / 'deep' / 'results'
    result = run('replay', folder, '--output', output, '--fps', '20', *PAPER)
    assert (result.returncode, result.stderr) == (0, '')
    assert 'movement  (7): 1x1 0x1 3x1 1x1 2x1 1x2' in result.stdout
    assert 'direction (6): 1x1 0x2 1x3' in result.stdout
    assert sorted(os.listdir(output)) == [
        'chain_code.json', 'manifest.json', 'shifts.csv', 'trajectory.png', 'trajectory.tum']

    code = json.loads((output / 'chain_code.json').read_text())
    assert (code['frames'], code['threshold']) == (8, 16.0)
    assert (code['movement'], code['direction']) == (MOVEMENT, DIRECTION)
    assert code['movement_runs'] == [[1, 1], [0, 1], [3, 1], [1, 1], [2, 1], [1, 2]]
    assert code['direction_runs'] == [[1, 1], [0, 2], [1, 3]]
    for name in ('movement', 'direction'):
        packed = bytes.fromhex(code[f'{name}_packed'])
        assert unpack(packed, len(code[name])) == code[name]
    assert code['status'] == ['ok', 'ok', 'turning', 'ok', 'ok', 'ok', 'ok']
    assert code['versions']['phase_traj_ros'] == phase_traj_ros.__version__
    assert code['versions']['transforms'] == find_transform().name
    assert str(folder) in code['source']

    rows = list(csv.DictReader((output / 'shifts.csv').open()))
    assert [int(row['movement']) for row in rows] == MOVEMENT
    assert [row['direction'] for row in rows] == ['1', '0', '', '0', '1', '1', '1']
    assert [round(float(row['dx'])) for row in rows] == [0, 30, 30, 0, -40, 0, 0]
    assert [row['stamp'] for row in rows][:2] == ['0.050000000', '0.100000000']
    assert {row['interval'] for row in rows} == {'0.050000000'}

    poses = np.loadtxt(output / 'trajectory.tum')
    assert poses.shape == (8, 8)
    assert poses[:, 1:3].tolist() == [
        [0, 0], [1, 0], [1, 1], [1, 1], [1, 2], [2, 2], [3, 2], [4, 2]]
    yaw = 2 * np.arctan2(poses[:, 6], poses[:, 7])
    np.testing.assert_allclose(np.degrees(yaw), [0, 0, 90, 90, 90, 0, 0, 0], atol=1e-3)
    assert cv2.imread(str(output / 'trajectory.png')).std() > 1


def test_replay_without_output_writes_nothing(run, folder, tmp_path):
    result = run('replay', folder, cwd=tmp_path)
    assert result.returncode == 0
    assert os.listdir(tmp_path) == ['pictures']


def test_a_second_replay_replaces_the_results(run, folder, tmp_path):
    output = tmp_path / 'results'
    assert run('replay', folder, '--output', output, *PAPER).returncode == 0
    assert run(
        'replay', folder, '--output', output, '--every', '2', *PAPER).returncode == 0
    assert json.loads((output / 'chain_code.json').read_text())['frames'] == 4
    assert len(os.listdir(output)) == 5


def test_threshold_overrides_the_parameter_file(run, folder, tmp_path):
    params = tmp_path / 'params.yaml'
    params.write_text('/**:\n  ros__parameters:\n    threshold: 35.0\n')
    code = 'movement  (7): '
    assert code + '1x4 2x1 1x2' in run('replay', folder, '--params', params).stdout
    over = run('replay', folder, '--params', params, '-p', 'threshold:=16.0')
    plain = run('replay', folder, *PAPER)
    assert over.stdout.split('movement')[1] == plain.stdout.split('movement')[1]
    both = run('replay', folder, '--params', params, '--threshold', '50')
    assert code + '1x7' in both.stdout


def test_a_file_of_the_package_is_given_by_its_name(run, folder, tmp_path):
    named = run(
        'replay', folder, '--params', 'paper.yaml', '--output', tmp_path / 'out', cwd=tmp_path)
    plain = run('replay', folder, *PAPER)
    assert named.stdout.split('movement')[1].splitlines()[0] == plain.stdout.split(
        'movement')[1].splitlines()[0]


def test_selection_reaches_the_source(run, folder):
    result = run('replay', folder, '--start', '0.2', '--duration', '0.4', *PAPER)
    assert '4 frames' in result.stdout
    assert 'movement  (3): 1x2 2x1' in result.stdout


def test_inspect_draws_the_correlation_map(run, folder, tmp_path):
    output = tmp_path / 'map.png'
    result = run('inspect', folder / '1.png', folder / '2.png', '--output', output)
    assert result.returncode == 0
    assert float(result.stdout.split()[1]) == pytest.approx(30, abs=0.05)
    assert cv2.imread(str(output)).std() > 1


def test_version_and_help(run):
    first, second = run('--version').stdout.splitlines()[:2]
    assert first == f'phase_traj_ros {phase_traj_ros.__version__}'
    assert second == f'transforms: {find_transform().name}'
    assert 'replay' in run('--help').stdout
    for command in ('replay', 'evaluate', 'play', 'inspect', 'demo'):
        result = run(command, '--help')
        assert result.returncode == 0
        assert len(result.stdout) > 300


def test_no_threshold_leaves_the_choice_to_the_code_source(run, folder, tmp_path):
    output = tmp_path / 'results'
    for options, source in (
            ([], 'auto'), (['--threshold', '0'], 'auto'), (PAPER, None),
            (['-p', 'code_source:=heading', '-p', 'hfov_deg:=80.0'], 'heading'),
            (['-p', 'code_source:=shift'], None)):
        assert run('replay', folder, '--output', output, *options).returncode == 0
        code = json.loads((output / 'chain_code.json').read_text())
        assert (code.get('code_source'), code['threshold']) == (
            (source, None) if source else (None, 16.0))


@pytest.mark.parametrize('threshold', ['-16', 'nan', 'inf', '-inf'])
def test_threshold_has_to_be_finite_and_positive(refused, folder, tmp_path, threshold):
    output = tmp_path / 'results'
    message = refused('replay', folder, f'--threshold={threshold}', '--output', output)
    assert 'give 0 to 10000' in message
    assert not output.exists()


def test_the_help_of_replay_lists_what_a_user_and_a_vehicle_may_need(run):
    text = run('replay', '--help').stdout
    for spec in specs():
        assert (f'  {spec.name} ({spec.default!r}): ' in text) == (
            spec.group in (Group.USER, Group.VEHICLE))
    assert [spec.name for spec in specs() if spec.group is Group.USER] == [
        'threshold', 'hfov_deg', 'camera_height', 'rotate_180']
    assert text.index(Group.USER.value[1:]) < text.index(Group.VEHICLE.value[1:])


@pytest.mark.parametrize(
    ('option', 'value'), [
        ('--rate', '0'), ('--rate', 'nan'), ('--clock', '0'), ('--wait', 'nan'),
        ('--wait', '1e300')])
def test_play_refuses_invalid_times(refused, folder, option, value):
    assert f'argument {option}: {value!r} does not fit: give a' in refused(
        'play', folder, option, value)


@pytest.mark.parametrize('arguments', [
    ['locate', '{name}', '--map', 'town.osm'], ['inspect', '{name}'],
    ['replay', '{name}', '{name}', '--output', '{out}'],
    ['replay', '{folder}', '--params', '{name}']])
def test_a_path_that_cannot_be_examined_is_one_line(refused, folder, tmp_path, arguments):
    name, out = 'x' * 300, tmp_path / 'out'
    assert refused(*(
        each.format(name=name, folder=folder, out=out) for each in arguments),
    ).startswith('phase_traj: error: ')


def test_a_process_ends_with_the_status_and_the_line():
    assert 'does not exist' in checked(in_a_process('replay', '/does/not/exist'))


@pytest.mark.parametrize(('arguments', 'message'), [
    (['{folder}', '--topic', '/image'], 'leave out topic'),
    (['{folder}', '--jobs', '0'], 'give 1 or more'),
    (['{folder}', '--every', '0'], 'every must be a whole number'),
    (['{folder}', '--start', '60'], 'no frame is selected'),
    (['{folder}', '--duration', '0.1'], '1 frame to use, but a trajectory needs at least two'),
    (['{folder}', '--fps', '0'], 'fps must be'),
    (['{folder}', '--speed-topic', '/speed'], 'is not a bag and has no speeds'),
    (['{folder}', '--params', '/does/not/exist.yaml'], 'there is no parameter file'),
    (['{folder}', '-p', 'threshold=3'], 'write NAME:=VALUE'),
    (['{folder}', '-p', 'threshold:=3'], 'such as 3.0'),
    (['{folder}', '-p', 'output_dir:=out'], 'in the node only: use --output'),
    (['{folder}', '-p', 'code_source:=heading'], 'give focal_px or hfov_deg'),
    (['{folder}', '--output', '/dev/null'], 'cannot write to'),
    (['{folder}', '--output', '/dev/null/below'], 'cannot write to'),
    (['{empty}'], 'no'),
    (['{file}'], 'is a text file, not a video'),
    pytest.param(['{bag}'], 'cannot be read', marks=pytest.mark.skipif(
        find_spec('rosbags') is None, reason='rosbags is not installed')),
    ([], 'SOURCE'),
    (['{folder}', '--nonsense'], '--nonsense'),
    (['{folder}', '--threshold', 'many'], 'many'),
])
def test_replay_reports_errors_in_one_line(refused, folder, tmp_path, arguments, message):
    empty = tmp_path / 'empty'
    empty.mkdir()
    file = tmp_path / 'foreign.mp4'
    file.write_bytes(b'this is no video' * 100)
    bag = tmp_path / 'broken.mcap'
    bag.write_bytes(b'\x89MCAP0\r\n' + bytes(200))
    before = sorted(tmp_path.rglob('*'))
    filled = [
        each.format(folder=folder, empty=empty, file=file, bag=bag) for each in arguments]
    assert message in refused('replay', *filled)
    assert sorted(tmp_path.rglob('*')) == before


def test_a_broken_picture_leaves_nothing_behind(refused, folder, tmp_path):
    picture = folder / '5.png'
    picture.write_bytes(picture.read_bytes()[:200])
    output = tmp_path / 'results'
    assert '5.png' in refused('replay', folder, '--output', output, '--strict')
    assert not output.exists()


@pytest.mark.parametrize('content', [b'', b'\x89PNG'])
def test_a_broken_picture_is_skipped_and_warned_of(run, folder, tmp_path, content):
    (folder / '5.png').write_bytes(content)
    done = run('replay', folder, '--output', tmp_path / 'results', *PAPER)
    assert done.returncode == 0
    assert re.search(r'warning: frames skipped: 1; the first: frame 5: .*5\.png', done.stderr)
    written = json.loads((tmp_path / 'results' / 'chain_code.json').read_text())
    assert (written['skipped_frames'], written['dropped_frames']) == (1, 0)
    assert 5 not in written['frame_numbers']


def test_a_broken_picture_leaves_older_results_alone(run, refused, folder, tmp_path):
    output = tmp_path / 'results'
    assert run('replay', folder, '--output', output, *PAPER).returncode == 0
    before = (output / 'chain_code.json').read_bytes()
    (folder / '5.png').write_bytes(b'')
    refused('replay', folder, '--output', output, '--strict')
    assert (output / 'chain_code.json').read_bytes() == before
    assert len(os.listdir(output)) == 5


def test_inspect_refuses_frames_that_do_not_match(refused, folder, tmp_path):
    cv2.imwrite(str(tmp_path / 'small.png'), np.eye(50, dtype=np.uint8) * 200)
    message = refused('inspect', folder / '0.png', tmp_path / 'small.png')
    assert '160x96' in message and '50x50' in message
    assert 'No such file' in refused('inspect', folder / '0.png', tmp_path / 'none.png')


def test_the_figure_of_two_frames_does_not_become_a_third(run, folder):
    before = sorted(os.listdir(folder))
    result = run('inspect', '0.png', '1.png', '--output', 'a.png', cwd=folder)
    assert result.returncode == 2 and 'would lie beside the frames' in result.stderr
    result = run('inspect', '0.png', '1.png', cwd=folder)
    assert result.returncode == 0 and result.stdout.startswith('dx ')
    figure = folder.parent / 'correlation.png'
    assert sorted(os.listdir(folder)) == before and not figure.exists()
    result = run('inspect', '0.png', figure, '--output', figure, cwd=folder)
    assert result.returncode == 2 and 'would lie beside the frames' in result.stderr
    # A file that the call names is replaced.
    figure.write_text('mine')
    result = run('inspect', '0.png', '1.png', '--output', figure, cwd=folder)
    assert result.returncode == 0 and f'written to {figure}' in result.stdout
    assert figure.read_bytes()[1:4] == b'PNG'


def test_inspect_says_what_to_give(refused, folder, tmp_path):
    film = tmp_path / 'film.mp4'
    film.write_bytes(b'film')
    assert 'film.mp4 is not an image: give two images' in refused('inspect', film)
    assert 'pictures is not an image' in refused('inspect', folder, folder / '1.png')
    assert 'the second image is missing' in refused('inspect', folder / '1.png')
    assert 'map.txt is not the name of a picture: end it in .png' in refused(
        'inspect', folder / '0.png', folder / '1.png', '--output', tmp_path / 'map.txt')
    assert not (tmp_path / 'map.txt').exists()


def test_a_missing_package_is_named_and_a_broken_installation_told(refused, folder, monkeypatch):
    monkeypatch.setitem(sys.modules, 'matplotlib', None)
    problem = refused(
        'inspect', folder / '0.png', folder / '1.png', '--output', folder.parent / 'map.png')
    assert 'the Python package matplotlib is missing: install ' in problem
    monkeypatch.setitem(sys.modules, 'phase_traj_ros.cli.program', None)
    with pytest.raises(ModuleNotFoundError, match=r'cli\.program'):
        main(['--help'])


@pytest.mark.parametrize('output', ['.', 'results', '../pictures/a'])
def test_results_do_not_become_frames(refused, folder, output):
    before = sorted(os.listdir(folder))
    assert 'input' in refused('replay', folder, *PAPER, '--output', folder / output)
    assert sorted(os.listdir(folder)) == before


def test_a_recording_is_not_replaced_by_its_result(run, refused, folder, tmp_path):
    pytest.importorskip('rosbags')
    recording = tmp_path / 'y.mcap'
    assert run(
        'replay', folder, *PAPER, '--bag-out', recording, '--bag-debug-images').returncode == 0
    before = recording.read_bytes()
    assert 'is an input' in refused('replay', recording, *PAPER, '--bag-out', recording)
    assert recording.read_bytes() == before


def test_a_page_of_the_user_stays(run, refused, folder, tmp_path):
    output = tmp_path / 'out'
    output.mkdir()
    (output / 'report.html').write_text('mine')
    call = ['replay', folder, *PAPER, '--output', output]
    assert run(*call).returncode == 0
    message = refused(*call, '--report')
    assert 'report.html was not written by an earlier run' in message and '--force' in message
    assert (output / 'report.html').read_text() == 'mine'
    assert run(*call, '--report', '--force').returncode == 0
    assert (output / 'report.html').read_text() != 'mine'
