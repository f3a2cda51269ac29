# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Heading and turns, live and replayed."""

from itertools import groupby
import json
import math

from geometry_msgs.msg import QuaternionStamped, Vector3Stamped
from live import image, LOSSLESS
import numpy as np
from phase_traj_ros.cli.main import main
from phase_traj_ros.synthetic import named_drive, render_drive
import pytest
from std_msgs.msg import Float64, UInt8
from std_srvs.srv import Trigger


@pytest.fixture(scope='module')
def drive():
    """Return the demo's drive up to the end of its second turn, and its frames."""
    drive = named_drive('demo').take(range(135))
    return drive, list(render_drive(drive))


def test_the_live_heading_is_the_true_one(live, drive, tmp_path):
    drive, frames = drive
    focal = f'focal_px:={drive.camera.focal}'
    live.start(
        '-p', 'code_source:=heading', '-p', focal, '-p', f'output_dir:={tmp_path / "kept"}')
    kinds = {
        'movement': UInt8, 'direction': UInt8, 'heading': Float64,
        'heading_stamped': QuaternionStamped, 'turn': Vector3Stamped}
    heard = {name: live.listen(kind, f'phase_traj/{name}', LOSSLESS)
             for name, kind in kinds.items()}
    live.call(Trigger, 'phase_traj/reset', Trigger.Request())
    camera = live.camera()
    for frame, stamp in zip(frames, drive.stamps_ns.tolist()):
        camera.publish(image(frame, stamp))
    live.until(lambda: all(
        len(heard[name]) == len(drive) - 1 for name in ('movement', 'heading', 'heading_stamped')))
    truth = np.unwrap(drive.poses[:, 2])[1:]
    error = np.degrees([each.data for each in heard['heading']] - truth)
    assert np.abs(error).max() < 3
    quaternion = heard['heading_stamped'][-1].quaternion
    assert 2 * math.atan2(quaternion.z, quaternion.w) == pytest.approx(
        heard['heading'][-1].data, abs=1e-6)
    live.until(lambda: len(heard['turn']) == 2)
    angles = [math.degrees(each.vector.z) for each in heard['turn']]
    assert angles == pytest.approx([90, -90], abs=4)
    assert live.call(Trigger, 'phase_traj/save', Trigger.Request()).success
    saved = json.loads((tmp_path / 'kept' / 'chain_code.json').read_text())
    assert [turn['quarter_turns'] for turn in saved['turns']] == [1, -1]
    directions = [each.data for each in heard['direction']]
    assert [code for code, _ in groupby(directions)] == [1, 0, 1]


@pytest.mark.parametrize(('clip', 'focal', 'turns'), [('00', 718.856, 1), ('06', 707.091, 0)])
def test_real_driving(kitti_root, tmp_path, clip, focal, turns):
    params = tmp_path / 'heading.yaml'
    params.write_text(
        f'/**:\n  ros__parameters: {{code_source: heading, focal_px: {focal}}}\n')
    assert not main([
        'replay', str(kitti_root / clip), '--params', str(params), '--output',
        str(tmp_path / 'out')])
    code = json.loads((tmp_path / 'out' / 'chain_code.json').read_text())
    poses = np.loadtxt(kitti_root / clip / 'poses.txt').reshape(-1, 3, 4)
    truth = -np.degrees(np.unwrap(np.arctan2(poses[:, 0, 2], poses[:, 2, 2])))
    error = code['heading_deg'] - (truth - truth[0])
    assert abs(error[-1]) <= 1.0
    assert np.abs(error).max() <= 4.0
    assert len(code['turns']) == turns
    assert len(code['direction']) == len(code['movement']) - code['movement'].count(3)
