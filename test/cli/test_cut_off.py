# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is not right with a recording is said by every command that reads it."""

import csv
import re

import cv2
from made_town import write_town
import numpy as np
from phase_traj_ros.cli.main import main
import pytest
from rolled import rolled_frames, write_rolled

# How many can be read is up to the decoder.
CUT_OFF = (
    r'14 frames are declared, but only \d+ could be read: the recording is cut off or damaged,'
    ' or a trimmed video')
GIVEN = ('-p', 'focal_px:=300.0', '-p', 'speed:=5.0', '-p', 'code_source:=shift')


@pytest.fixture
def cut_off(tmp_path):
    path = tmp_path / 'drive.avi'
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), 10.0, (160, 96))
    for frame in rolled_frames([5] * 13):
        writer.write(np.repeat(frame.image[..., np.newaxis], 3, axis=2))
    writer.release()
    # Each frame is a chunk of this name.
    *chunks, _ = path.read_bytes().split(b'00dc')[:12]
    path.write_bytes(b'00dc'.join(chunks))
    return path


def test_replay_and_its_report(cut_off, tmp_path, capsys):
    out = tmp_path / 'out'
    assert main(['replay', str(cut_off), '--output', str(out), '--report', *GIVEN]) == 0
    assert re.search(f'^warning: {CUT_OFF}$', capsys.readouterr().err, re.MULTILINE)
    page = (out / 'report.html').read_text()
    assert re.search(CUT_OFF, page) and 'No reason to doubt' not in page


def test_several_recordings(cut_off, tmp_path):
    whole = write_rolled(tmp_path / 'whole')
    out = tmp_path / 'out'
    assert main([
        'replay', str(whole), str(cut_off), '--jobs', '1', '--output', str(out), *GIVEN]) == 0
    with (out / 'summary.csv').open() as file:
        missing = [int(row['missing_frames']) for row in csv.DictReader(file)]
    assert missing[0] == 0 < missing[1]


def test_locate(cut_off, tmp_path, capsys):
    town = write_town(tmp_path / 'town.osm')
    assert main(['locate', str(cut_off), '--map', str(town), *GIVEN]) == 1
    assert re.search(f'^warning: {CUT_OFF}$', capsys.readouterr().err, re.MULTILINE)


def test_calibrate(cut_off, capsys):
    assert main(['calibrate', str(cut_off)]) == 1
    assert re.fullmatch(f'warning: .*drive.avi: {CUT_OFF}\n', capsys.readouterr().err)
