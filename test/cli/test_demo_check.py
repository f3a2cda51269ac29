# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The demo fails if the codes are not those of the drive."""

import numpy as np
from phase_traj_ros.cli.commands.demo import check_turns
from phase_traj_ros.errors import ResultError
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.synthetic import named_drive
import pytest

TEXTURE = np.random.default_rng(0).integers(0, 256, (64, 100), dtype=np.uint8)


def driven(turns, count=201):
    """Return a replay that turns for 20 frames from each of the given frames."""
    shifts = np.zeros(count, int)
    for frame, dx in turns.items():
        shifts[frame:frame + 20] = dx
    return replay(
        (StampedFrame(np.roll(TEXTURE, position, axis=1), index * 100_000_000)
         for index, position in enumerate(np.cumsum(shifts))), Parameters(threshold=16.0),
        source='test')


@pytest.fixture(scope='module')
def drive():
    """Return the demo's drive and frames in the middle of its turns."""
    drive = named_drive('demo')
    return drive, [(turn.start_frame + turn.end_frame) // 2 - 10 for turn in drive.turns]


def test_the_right_turns_pass(drive):
    drive, (first, second, third) = drive
    check_turns(drive, driven({first: 20, second: -20, third: 20}))


def test_wrong_turns_are_found(drive):
    drive, (first, second, third) = drive
    for wrong in (
            {}, {first: 20, second: -20}, {first: -20, second: 20, third: 20},
            {first: 20, second: -20, third: 20, third + 30: -20}):
        with pytest.raises(ResultError, match='were driven'):
            check_turns(drive, driven(wrong))


def test_turns_at_a_wrong_time_are_found(drive):
    drive, (first, second, third) = drive
    with pytest.raises(ResultError, match='coded at frame'):
        check_turns(drive, driven({first: 20, second + 33: -20, third: 20}))
