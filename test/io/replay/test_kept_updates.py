# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Kept updates are those that were given, and take little memory."""

import gc
import tracemalloc

from phase_traj_ros.core import Corner, Direction, Movement, PairStatus, Shift, Update
from phase_traj_ros.core.codes.chain import Step
from phase_traj_ros.io.replay.kept_updates import KeptUpdates
import pytest


def update(pair):
    return Update(
        pair, pair * 33_333_333, 33_333_333, Shift(0.1 * pair, 0.3 * pair, 1.0 / (pair + 1)),
        Step(Movement.FORWARD, Direction.FORWARD), PairStatus.OK,
        Corner(1.1 * pair, 0.7, 0.2, pair))


@pytest.mark.parametrize('count', [0, 1, 1023, 1024, 1025, 3000])
def test_they_are_a_sequence_of_what_was_given(count):
    given, kept = [update(pair) for pair in range(count)], KeptUpdates()
    for each in given:
        kept.append(each)
    assert list(kept) == given and len(kept) == count
    assert [kept[index] for index in range(-count, count)] == given * 2
    assert kept[count // 2:] == given[count // 2:] and kept[::-7] == given[::-7]
    with pytest.raises(IndexError):
        kept[count]


def test_an_hour_at_30_hz_takes_little_memory():
    gc.collect()
    tracemalloc.start()
    try:
        kept = KeptUpdates()
        for pair in range(20 * 1024):
            kept.append(update(pair))
        assert tracemalloc.get_traced_memory()[0] < 200 * len(kept)
    finally:
        tracemalloc.stop()
