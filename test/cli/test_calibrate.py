# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The field of view from a drive, and codes from the heading with nothing known of the camera."""

import json
import re

import numpy as np
from phase_traj_ros.cli.main import main
from phase_traj_ros.synthetic import (
    Camera,
    plan_drive,
    Straight,
    Turn,
    write_drive_bag,
)
import pytest

HFOV = 100.0
PLAN = [Straight(2), *[
    part for angle in (90, -86, 93, 90, -92, 88) for part in (Turn(angle, 3, 4), Straight(2))]]


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Return a bag of six turns at crossings, and of the first two of them."""
    drive = plan_drive(
        'six turns', PLAN, rate_hz=10.0, speed=8.0,
        camera=Camera.with_field_of_view(320, 160, HFOV), seed=5)
    folder = tmp_path_factory.mktemp('drives')
    write_drive_bag(drive, folder / 'six')
    write_drive_bag(drive.take(range(70)), folder / 'one')
    write_drive_bag(drive.take(range(15)), folder / 'none')
    return folder


def test_the_turns_tell_the_field_of_view(bag, capsys):
    assert main(['calibrate', str(bag / 'six')]) == 0
    found = float(re.search(r'hfov_deg: ([\d.]+)', capsys.readouterr().out)[1])
    assert found == pytest.approx(HFOV, rel=0.05)


def test_too_few_turns_do_not(bag, capsys):
    assert main(['calibrate', str(bag / 'one')]) == 1
    assert 'not certain' in capsys.readouterr().out
    assert main(['calibrate', str(bag / 'none')]) == 2
    assert 'nothing tells the field of view' in capsys.readouterr().err


def test_codes_with_nothing_known_of_the_camera(bag, tmp_path):
    params = tmp_path / 'params.yaml'
    params.write_text('/**:\n  ros__parameters: {code_source: heading, estimate_fov: true}\n')
    out = tmp_path / 'out'
    assert main(['replay', str(bag / 'six'), '--params', str(params), '--output', str(out)]) == 0
    code = json.loads((out / 'chain_code.json').read_text())
    assert code['field_of_view']['hfov_deg'] == pytest.approx(HFOV, rel=0.05)
    assert code['field_of_view']['sureness'] > 0.9
    # The turns before it is settled are told late, but told.
    changes = [code for code in code['movement'] if code in (0, 2)]
    assert changes == [0, 2, 0, 0, 2, 0]
    # From the correction on, the heading is the true one.
    assert code['heading_deg'][-1] == pytest.approx(sum((90, -86, 93, 90, -92, 88)), rel=0.05)
    assert len(code['direction']) == len(code['movement']) - code['movement'].count(3)
    assert np.isfinite(code['heading_deg']).all()
