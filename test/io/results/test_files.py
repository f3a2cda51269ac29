# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The table of shifts: a row per pair holds all that was measured."""

import csv
from dataclasses import replace
import json

from far_scene import turned_drive
import numpy as np
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.results.files import CSV_COLUMNS, write_results
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.tasks.evaluation.replayed_drive import read_replay
import pytest

BLIND = 18
"""A frame in the middle of the first turn that shows nothing."""


@pytest.fixture(scope='module')
def drive():
    camera, pictures = turned_drive()
    pictures[BLIND] = np.zeros_like(pictures[BLIND])
    return camera, [StampedFrame(picture, index * 10**8) for index, picture in enumerate(pictures)]


def written(drive, folder, **values):
    result = replay(drive[1], Parameters(**values), source='a drive')
    write_results(result, folder)
    with (folder / 'shifts.csv').open(encoding='utf-8', newline='') as file:
        return list(csv.DictReader(file))


def test_columns_keep_their_names_and_order():
    assert CSV_COLUMNS == (
        'pair', 'stamp', 'interval', 'dx', 'dy', 'response', 'movement', 'direction', 'status',
        'heading_deg', 'yaw_deg', 'bridged', 'distance', 'distance_variance', 'distance_state',
        'speed', 'speed_variance', 'yaw_variance')


@pytest.mark.parametrize('code_source', ['shift', 'heading'])
def test_heading_yaw_and_what_was_bridged(drive, tmp_path, code_source):
    rows = written(drive, tmp_path, focal_px=drive[0].fx, code_source=code_source)
    heading, yaw = ([float(row[name]) for row in rows] for name in ('heading_deg', 'yaw_deg'))
    content = json.loads((tmp_path / 'chain_code.json').read_text())
    assert [0.0, *heading] == content['heading_deg']
    np.testing.assert_allclose(np.cumsum(yaw), heading, atol=0.01)
    assert min(heading) == pytest.approx(-90, abs=3) and max(heading) == pytest.approx(90, abs=3)
    bridged = [int(row['pair']) for row in rows if row['bridged'] == '1']
    assert {BLIND - 1, BLIND} <= set(bridged)
    assert len(bridged) == round(content['bridged_share'] * len(rows))
    assert {row['bridged'] for row in rows} == {'0', '1'}
    np.testing.assert_allclose(np.degrees(read_replay(tmp_path).heading)[1:], heading)


def test_repeated_pictures_are_no_share_of_what_was_bridged(drive, tmp_path):
    twice = [
        replace(frame, stamp_ns=frame.stamp_ns + later) for frame in drive[1]
        for later in (0, 4 * 10**7)]
    rows = written((None, twice), tmp_path, focal_px=drive[0].fx, code_source='heading')
    content = json.loads((tmp_path / 'chain_code.json').read_text())
    others = [row['bridged'] for row in rows if row['status'] != 'repeated']
    assert len(others) < 0.6 * len(rows)
    assert '1' in others
    assert content['bridged_share'] == pytest.approx(others.count('1') / len(others))


@pytest.mark.parametrize(('values', 'unit'), [
    ({'path_from': 'heading', 'speed': 5.0}, 'm'), ({'path_from': 'codes', 'speed': 5.0}, 'step'),
    ({'path_from': 'heading', 'use_speed_topic': True}, 'm'),
    ({'path_from': 'heading'}, 'camera heights')])
def test_the_unit_of_the_path(drive, tmp_path, values, unit):
    written(drive, tmp_path, focal_px=drive[0].fx, **values)
    assert json.loads((tmp_path / 'chain_code.json').read_text())['path_unit'] == unit
    assert read_replay(tmp_path).metric == (unit == 'm')


def test_without_a_camera_the_new_columns_are_empty(drive, tmp_path):
    rows = written(drive, tmp_path, code_source='shift')
    assert {(row['heading_deg'], row['yaw_deg'], row['bridged']) for row in rows} == {('', '', '')}
    assert len(read_replay(tmp_path).stamps_ns) == len(rows) + 1
