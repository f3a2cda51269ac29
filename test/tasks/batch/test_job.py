# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""One source replayed with several results, one of which cannot be written."""

import errno
import os

from phase_traj_ros.errors import OutputError, SourceError
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.tasks.batch.job import replay_source, ReplayRequest
import pytest
from rolled import write_rolled


@pytest.fixture
def folder(tmp_path):
    return write_rolled(tmp_path / 'drive')


def replayed(folder, **wanted):
    request = ReplayRequest(source=folder, parameters=Parameters(threshold=16.0), **wanted)
    with request.opened() as source:
        return replay_source(source, request)


def test_a_wrong_speed_topic_is_refused_before_a_frame_is_read(folder):
    request = ReplayRequest(
        source=folder, parameters=Parameters(use_speed_topic=True, path_from='heading'))

    def through(*_):
        pytest.fail('a pass has begun')

    with request.opened() as source, pytest.raises(SourceError, match='is not a bag'):
        replay_source(source, request, through=through)


def no_space(*_, **__):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_failing_result_is_named_and_leaves_the_older_ones(folder, tmp_path, monkeypatch):
    pytest.importorskip('rosbags')
    output = tmp_path / 'out'
    replayed(folder, output=output, report=True)
    before = {path.name: path.read_bytes() for path in output.iterdir()}
    monkeypatch.setattr('phase_traj_ros.tasks.batch.job.write_results', no_space)
    with pytest.raises(OutputError, match=r'out: No space'):
        replayed(folder, output=output, bag_out=tmp_path / 'bags' / 'drive.mcap')
    assert {path.name: path.read_bytes() for path in output.iterdir()} == before
    assert {path.name for path in tmp_path.iterdir()} == {'drive', 'out'}
    monkeypatch.undo()
    replayed(folder, output=output)
    assert {path.name for path in output.iterdir()} == before.keys() - {'report.html'}
