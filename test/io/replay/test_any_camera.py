# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Right turns and camera where nothing is known of it: a slice of `make any-camera`."""

from dataclasses import replace
import math

import numpy as np
from phase_traj_ros.core import Movement
from phase_traj_ros.io.replay.camera import learned_lens
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
from phase_traj_ros.synthetic.camera import EQUIDISTANT
import pytest

wide = Camera.with_field_of_view
# Camera, its rate and pitch, the plan, and the turns that are right.
DRIVES = {
    'oblique crossings': (
        wide(320, 240, 62.0), 10.0, 0.0,
        [Straight(1), Turn(75, 3, 4.5), Straight(2), Turn(-110, 3.5, 4.5), Straight(1)], 'LR'),
    'bends of a wide view': (
        wide(320, 200, 100.0), 10.0, 0.0,
        [Straight(1), Turn(-90, 9), Straight(1), Turn(90, 9), Straight(1)], 'RL'),
    'a U-turn of a fisheye': (
        wide(240, 180, 130.0, fisheye=EQUIDISTANT), 12.0, 5.0,
        [Straight(1), Turn(-180, 6, 4), Straight(1)], 'RR'),
    'a lap of a narrow view': (
        wide(320, 240, 45.0), 10.0, 0.0, [Straight(1), Turn(360, 11, 5), Straight(1)], 'LLLL'),
    'a tilted camera': (
        wide(320, 240, 75.0), 10.0, 15.0,
        [Straight(1), Turn(90, 3, 4.5), Straight(1.5), Turn(75, 2.5, 4.5), Straight(1)], 'LL'),
    'bends that turn nobody around': (
        wide(320, 240, 90.0), 10.0, 0.0,
        [Straight(1), Turn(-42, 3, 6), Turn(42, 3, 6), Straight(1)], ''),
    'standing still': (wide(320, 240, 75.0), 10.0, 0.0, [Straight(3, 0.0)], ''),
}


def frames_of(camera, rate_hz, pitch_deg, plan):
    drive = plan_drive('a slice', plan, rate_hz=rate_hz, speed=8.0, camera=camera, seed=5)
    poses = drive.poses.copy()
    poses[:, 3] = math.radians(pitch_deg)
    pictures = render_drive(replace(drive, poses=poses))
    return [
        StampedFrame(np.asarray(picture), stamp_ns)
        for (picture, stamp_ns) in zip(pictures, drive.stamps_ns.tolist())]


@pytest.mark.parametrize('name', DRIVES)
def test_the_turns_and_the_camera_are_right(name):
    (camera, *of, right) = DRIVES[name]
    frames = frames_of(camera, *of)
    lens = learned_lens(frames, Parameters(), name)
    found = replay(frames, Parameters(), source=name, lens=lens)
    turns = [code for code in found.movement if code in (Movement.LEFT, Movement.RIGHT)]
    assert ''.join('LR'[code is Movement.RIGHT] for code in turns) == right
    assert found.reliability.reliable
    if right:
        least, most = lens.estimate.focal_interval_px
        assert least < camera.focal < most < 1.5 * least
        assert lens.estimate.focal_px == pytest.approx(camera.focal, rel=0.1)
