# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The frames that ``phase_traj play`` publishes."""

from itertools import islice

from phase_traj_ros.cli.commands.play import _frames
from phase_traj_ros.errors import SourceError
from phase_traj_ros.io.sources.opening import open_source
import pytest
from rolled import write_rolled


def test_an_unreadable_frame_is_left_out_and_said(tmp_path, capsys):
    folder = write_rolled(tmp_path / 'drive', [0, 0, 0])
    (folder / '0002.png').write_bytes(b'')
    with open_source(folder) as source:
        assert [frame.number for frame in _frames(source, loop=False)] == [0, 1, 3]
        assert [frame.number for frame in islice(_frames(source, loop=True), 5)] == [0, 1, 3, 0, 1]
    assert 'warning: skipped frame 2: ' in capsys.readouterr().err


def test_a_source_without_a_usable_frame_ends_also_in_a_loop(tmp_path):
    folder = write_rolled(tmp_path / 'drive', [0])
    for path in folder.glob('*.png'):
        path.write_bytes(b'')
    with open_source(folder) as source, pytest.raises(SourceError, match='no frame can be used'):
        list(_frames(source, loop=True))
