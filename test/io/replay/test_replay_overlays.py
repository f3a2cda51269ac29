# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A film of two scenes with black bars and a bonnet: live, in one pass and in two."""

import numpy as np
from overlays import black_bars, bonnet
from phase_traj_ros.core import Movement
from phase_traj_ros.io.replay.camera import learned_lens
from phase_traj_ros.io.replay.estimator import make_estimator
from phase_traj_ros.io.replay.run import replay, Watcher
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight, Turn
import pytest

CAMERA = Camera.with_field_of_view(320, 240, 85.0)
BARS = 0.1


@pytest.fixture(scope='module')
def frames():
    scenes = [
        plan_drive('a scene', [Straight(1.5), Turn(angle, 3.5, 4.5), Straight(1.5)],
                   rate_hz=10.0, speed=8.0, camera=CAMERA, seed=seed)
        for angle, seed in ((90, 5), (-90, 8))]
    pictures = [picture for scene in scenes for picture in render_drive(scene)]
    return [
        StampedFrame(black_bars(bonnet(picture), sides=BARS), number * 100_000_000)
        for number, picture in enumerate(pictures)]


class Last(Watcher):
    """Keeps what was left out at the end."""

    left_out = None

    def add(self, frame, update, estimator):
        self.left_out = estimator.left_out


def codes(updates):
    return [
        (update.step, update.status, update.cut, update.heading.bridged) for update in updates]


def figures(updates):
    return np.array([
        (update.shift.dx, update.heading.heading, update.tip.x, update.tip.y)
        if update.shift else (0.0, update.heading.heading, update.tip.x, update.tip.y)
        for update in updates])


def test_live_codes_are_those_of_one_pass(frames):
    live = make_estimator(Parameters())
    added = [live.update(frame.image, frame.stamp_ns) for frame in frames]
    whole = replay(frames, Parameters(), source='film')
    assert codes(added[1:]) == codes(whole.updates)
    np.testing.assert_array_equal(figures(added[1:]), figures(whole.updates))
    assert sum(update.cut for update in whole.updates) == 1
    assert live.left_out is not None


def test_the_second_pass_leaves_out_what_is_fixed_too(frames):
    last = Last()
    lens = learned_lens(frames, Parameters(), 'film')
    found = replay(frames, Parameters(), source='film', lens=lens, watchers=[last])
    turns = [code for code in found.movement if code in (Movement.LEFT, Movement.RIGHT)]
    assert turns == [Movement.LEFT, Movement.RIGHT]
    assert sum(update.cut for update in found.updates) == 1
    bar = round(BARS * CAMERA.width)
    edges = np.concatenate([last.left_out[:, :bar // 2], last.left_out[:, -bar // 2:]], axis=1)
    assert edges.mean() < 64 < 192 < last.left_out[40:120, 2 * bar:-2 * bar].mean()
    assert lens.estimate.focal_px == pytest.approx(CAMERA.focal, rel=0.1)
