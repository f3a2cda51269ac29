# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera that the first pass of a replay learns."""

from crossing_lorry import crossing, halted
import numpy as np
from phase_traj_ros.io.replay import camera
from phase_traj_ros.io.replay.camera import learned_lens
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight
import pytest


@pytest.mark.parametrize('path_from', ['auto', 'codes'])
def test_a_lorry_in_front_of_a_standing_vehicle_is_no_turn(path_from):
    drive = list(render_drive(plan_drive(
        'a stop', [Straight(2.5)], rate_hz=10.0, speed=6.0, seed=8,
        camera=Camera.with_field_of_view(320, 240, 70.0))))
    lorry = crossing(drive[-1], width=1.5, height=0.75, step=-6)
    images = [*drive, *lorry, *halted(drive[-1], 5)]
    frames = [StampedFrame(image, n * 100_000_000) for n, image in enumerate(images)]
    # Without the road, nothing tells that the vehicle stands: the focal length was far too long.
    assert learned_lens(frames, Parameters(path_from=path_from), 'film') is None


@pytest.mark.parametrize(('rate_hz', 'used'), [(10, 12), (30, 12), (50, 12), (60, 6), (120, 4)])
def test_no_frame_of_a_film_is_left_out_up_to_50_hz(rate_hz, used, monkeypatch):
    seen = []

    def spied(estimator, entries, **_):
        seen.extend(entries)
        return ()

    monkeypatch.setattr(camera, 'outcomes', spied)
    frames = [
        StampedFrame(np.zeros((8, 8), np.uint8), round(n * 1e9 / rate_hz)) for n in range(12)]
    learned_lens(frames, Parameters(), 'film')
    assert len(seen) == used
