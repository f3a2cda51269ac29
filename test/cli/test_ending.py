# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""However the program ends, it leaves whole results or none, one line, and the right status."""

import os
import signal
import subprocess
import sys

import cv2
import numpy as np
from phase_traj_ros.cli import main as program
import pytest

PROGRAM = (sys.executable, '-m', 'phase_traj_ros.cli.main')
# Of the drive, in which pictures repeat.
WARNING = 'warning: frames with the stamp or the image of the previous one: 13\n'
LOADING = """
import os, signal, sys
import phase_traj_ros.cli.main as program
class Finder:
    def find_spec(self, name, *_):
        if name == 'cv2':
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
sys.exit(program.main(['--version']))
"""


@pytest.fixture
def drive(tmp_path):
    """Return a folder of pictures with turns."""
    folder = tmp_path / 'drive'
    folder.mkdir()
    rng = np.random.default_rng(1)
    texture = cv2.GaussianBlur(rng.integers(0, 256, (96, 160), dtype=np.uint8), (0, 0), 1.5)
    for index in range(20):
        place = 30 * (index // 3 % 2)
        cv2.imwrite(str(folder / f'{index:03}.png'), np.roll(texture, place, axis=1))
    return folder


def replay(drive, *arguments):
    return [*PROGRAM, 'replay', str(drive), '--threshold', '16', *map(str, arguments)]


def stopped_at(number, drive, tmp_path, monkeypatch, capfd):
    """Run a replay that gets the signal while it works; return its status and its error."""
    from phase_traj_ros.io.results.pictures import Thumbnails
    add, count = Thumbnails.add, iter(range(10**6))

    def signalled(self, *arguments):
        if next(count) == 5:
            os.kill(os.getpid(), number)
        add(self, *arguments)

    monkeypatch.setattr(Thumbnails, 'add', signalled)
    status = program.main([
        'replay', str(drive), '--threshold', '16', '--output', str(tmp_path / 'out' / 'a'),
        '--report'])
    return status, capfd.readouterr()


@pytest.mark.parametrize(('number', 'line'), [
    (signal.SIGINT, 'interrupted'), (signal.SIGTERM, 'terminated'), (signal.SIGHUP, 'hung up')])
def test_a_signal_leaves_nothing_unfinished(
        drive, tmp_path, monkeypatch, capfd, handlers, number, line):
    status, printed = stopped_at(number, drive, tmp_path, monkeypatch, capfd)
    assert (status, printed.out, printed.err) == (128 + number, '', f'phase_traj: {line}\n')
    assert [path.name for path in tmp_path.iterdir()] == ['drive']


def test_a_signal_that_the_caller_ignores_stays_ignored(
        drive, tmp_path, monkeypatch, capfd, handlers):
    # As nohup does.
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    status, printed = stopped_at(signal.SIGHUP, drive, tmp_path, monkeypatch, capfd)
    assert (status, printed.err) == (0, WARNING)
    assert (tmp_path / 'out' / 'a' / 'chain_code.json').exists()


def test_an_early_interrupt_is_one_line():
    result = subprocess.run(
        [sys.executable, '-c', LOADING], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stdout, result.stderr) == (
        130, '', 'phase_traj: interrupted\n')


def buffered(yes):
    """Return the environment of a process whose output is buffered or not."""
    kept = {name: value for name, value in os.environ.items() if name != 'PYTHONUNBUFFERED'}
    return kept if yes else {**kept, 'PYTHONUNBUFFERED': '1'}


def closed_early(call, *, both):
    """Run a call whose reader has gone; return its status and, if it is read, its error."""
    reading, writing = os.pipe()
    os.close(reading)
    try:
        result = subprocess.run(
            call, stdout=writing, stderr=writing if both else subprocess.PIPE, text=True,
            check=False, stdin=subprocess.DEVNULL, env=buffered(True))
    finally:
        os.close(writing)
    return result.returncode, result.stderr


@pytest.mark.parametrize('both', [True, False])
def test_the_work_is_finished_where_nobody_reads(drive, tmp_path, both):
    status, error = closed_early(
        replay(drive, '--output', tmp_path / 'out'), both=both)
    assert status == 128 + signal.SIGPIPE
    assert (tmp_path / 'out' / 'chain_code.json').exists()
    if not both:
        assert error.splitlines()[-1] == 'phase_traj: the reader of the output has closed it'
        assert 'Exception' not in error and 'Traceback' not in error


def test_help_that_nobody_reads():
    assert closed_early([*PROGRAM, 'replay', '--help'], both=False) == (
        141, 'phase_traj: the reader of the output has closed it\n')


@pytest.mark.parametrize('yes', [True, False])
def test_a_full_output_is_reported(drive, yes):
    with open('/dev/full', 'w') as full:
        result = subprocess.run(
            replay(drive), stdout=full, stderr=subprocess.PIPE, text=True, check=False,
            env=buffered(yes))
    assert (result.returncode, result.stderr) == (
        2, WARNING * yes
        + 'phase_traj: error: cannot write to the standard output: No space left on device\n')


def closed_streams(call, closing):
    """Run a call without some of its streams; return its status and its error."""
    result = subprocess.run(
        ['sh', '-c', f'exec "$@" {closing}', 'sh', *call], capture_output=True, text=True,
        check=False)
    return result.returncode, result.stderr


@pytest.mark.parametrize('closing', ['>&-', '2>&-'])
def test_a_closed_stream(drive, closing):
    assert closed_streams(replay(drive), closing) == (0, WARNING if closing == '>&-' else '')


def test_closed_streams(drive, tmp_path):
    call = replay(drive, '--output', tmp_path / 'out')
    assert closed_streams(call, '<&- >&- 2>&-') == (0, '')
    assert (tmp_path / 'out' / 'chain_code.json').exists()
