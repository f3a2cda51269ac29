# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""One source replayed with several results, one of which cannot be written."""

import errno
import os

from phase_traj_ros.errors import OutputError
from phase_traj_ros.io.results.animation import Animation
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.tasks.batch.job import replay_source
from phase_traj_ros.tasks.batch.request import ReplayRequest
import pytest
from rolled import write_rolled


@pytest.fixture
def folder(tmp_path):
    return write_rolled(tmp_path / 'drive')


def replayed(folder, **wanted):
    request = ReplayRequest(source=folder, parameters=Parameters(threshold=16.0), **wanted)
    with request.opened() as source:
        return replay_source(source, request)


def no_space(*_, **__):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_failing_animation_is_named_and_leaves_the_older_report(folder, tmp_path, monkeypatch):
    output = tmp_path / 'out'
    replayed(folder, output=output, report=True)
    before = {path.name: path.read_bytes() for path in output.iterdir()}
    monkeypatch.setattr(Animation, 'write', no_space)
    with pytest.raises(OutputError, match=r'drive\.gif: No space'):
        replayed(folder, output=output, animation=tmp_path / 'drive.gif')
    assert {path.name: path.read_bytes() for path in output.iterdir()} == before
    assert 'report.html' in before
    monkeypatch.undo()
    replayed(folder, output=output, animation=tmp_path / 'drive.gif')
    assert {path.name for path in output.iterdir()} == before.keys() - {'report.html'}


def test_a_failing_folder_is_named_and_not_the_animation(folder, tmp_path, monkeypatch):
    monkeypatch.setattr('phase_traj_ros.tasks.batch.job.write_results', no_space)
    with pytest.raises(OutputError, match=r'out: No space'):
        replayed(folder, output=tmp_path / 'out', animation=tmp_path / 'gifs' / 'drive.gif')
    assert [path.name for path in tmp_path.iterdir()] == ['drive']
