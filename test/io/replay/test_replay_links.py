# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Equal links of a rendered street, driven in several ways."""

import numpy as np
from phase_traj_ros.core import TravelState
from phase_traj_ros.io.replay.camera import known_lens
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.io.sources.selection import Selection
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import plan_drive, render_drive, Straight, Turn
import pytest
from smaller import THIRD

STREET = (Straight(1.5), Turn(90, 2.5, 5.5), Straight(1.0), Turn(-90, 2.5, 5.5), Straight(1.5))
# In the middle of the first turn.
STOP, STANDS = 56, 20


@pytest.fixture(scope='module')
def drive():
    """Return the drive at 20 Hz, and its pictures."""
    found = plan_drive(
        'street', STREET, rate_hz=20.0, speed=7.0, seed=1, camera=THIRD)
    return found, list(render_drive(found))


def driven(pictures, rate_hz, **values):
    frames = [
        StampedFrame(picture, 10**18 + round(index * 1e9 / rate_hz))
        for index, picture in enumerate(pictures)]
    return replay(frames, Parameters(focal_px=THIRD.focal, **values), source='')


def with_a_stop(pictures):
    """Stand still before a picture; the camera has some noise."""
    rng = np.random.default_rng(1)
    stood = [
        np.clip(pictures[STOP] + rng.normal(0, 1, pictures[STOP].shape), 0, 255).astype(np.uint8)
        for _ in range(STANDS)]
    return [*pictures[:STOP:2], *stood, *pictures[STOP::2]]


def test_speed_stop_and_rate_make_no_difference(drive):
    _, pictures = drive
    plain = driven(pictures[::2], 10.0, camera_height=1.65, code_step=2.0)
    runs = plain.links.series.runs
    assert [int(run.code) for run in runs] == [1, 0, 1]
    for pictured, rate_hz in (
            (pictures, 10.0), (pictures, 20.0), (with_a_stop(pictures), 10.0)):
        other = driven(pictured, rate_hz, camera_height=1.65, code_step=2.0)
        assert [run.code for run in other.links.series.runs] == [run.code for run in runs]
        for run, same in zip(other.links.series.runs, runs):
            assert abs(run.count - same.count) <= max(1, 0.02 * same.count)
    # The last one has stopped: standing adds nothing, and the code per pair goes on.
    stood = [
        update for update in other.updates if update.travel.state is TravelState.STANDING]
    # It takes 0.3 s to tell.
    assert len(stood) >= STANDS - 4 and not any(update.links for update in stood)
    assert len(other.direction) > len(plain.direction)


def test_real_driving_at_half_the_rate(kitti_root):
    parameters = Parameters(code_step=2.5, camera_height=1.65)
    # Around a corner.
    with open_source(
            kitti_root / '00', selection=Selection(start=5.0, duration=12.0)) as source:
        (lens, _), frames = known_lens(source, parameters), list(source)
    whole, half = (replay(every, parameters, source='', lens=lens) for every in (
        frames, frames[::2]))
    assert [int(run.code) for run in whole.links.series.runs] == [1, 2]
    for run, other in zip(whole.links.series.runs, half.links.series.runs, strict=True):
        assert run.code is other.code and abs(run.count - other.count) <= 1
    assert len(half.direction) < 0.6 * len(whole.direction)


@pytest.mark.parametrize(('values', 'unit', 'metres'), [
    ({'camera_height': 1.65}, 'm', 1.0), ({'path_from': 'codes'}, 'camera heights', 1.65)])
def test_there_are_as_many_as_the_street_is_long(drive, values, unit, metres):
    found, pictures = drive
    coded = driven(pictures[::2], 10.0, code_step=1.5, code_source='heading', **values)
    assert coded.parameters.settings.length_unit.value == unit
    length = np.hypot(*np.diff(found.poses[:, :2], axis=0).T).sum()
    assert len(coded.links.series) == pytest.approx(length / metres / 1.5, abs=2)
