# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A growing series of bounded length, evenly thinned."""

import numpy as np
from phase_traj_ros.core.path.thinning import Thinned
from phase_traj_ros.core.path.way import Way
from phase_traj_ros.core.road.travel import Travel, TravelState
import pytest


@pytest.mark.parametrize('limit', [1, 2, 7, 10])
def test_it_keeps_the_first_and_equal_steps_from_it_and_no_more_than_the_limit(limit):
    thinned = Thinned(limit)
    for number in range(500):
        thinned.offer(number)
        kept = thinned.kept
        assert len(kept) <= limit and kept[0] == 0
        if len(kept) > 1:
            step = kept[1]
            assert np.log2(step) % 1 == 0.0
            assert kept == tuple(range(0, kept[-1] + 1, step)) and number - kept[-1] < step
        # It is not thinner than it has to be.
        assert len(kept) >= min((limit + 1) // 2, number + 1)


def test_without_a_limit_it_keeps_all_and_starts_again_when_cleared():
    thinned = Thinned(None)
    for number in range(100):
        thinned.offer(number)
    assert thinned.kept == tuple(range(100))
    thinned.clear()
    thinned.offer(7)
    assert thinned.kept == (7,)


def test_a_way_counts_each_pair_once_and_adds_what_is_known():
    way = Way()
    for distance, state in ((2.0, 'measured'), (-1.0, 'bridged'), (5.0, 'unknown')):
        way.add(Travel(distance, 0.1, TravelState(state)), 0.5)
    assert way.pairs == 3 and way.states[TravelState.BRIDGED] == 1
    assert way.distance == 3.0 and way.speed is None
    way.add(Travel(-1.0, 0.1, TravelState.MEASURED), 0.5)
    assert way.speed == -2.0


def test_the_next_pair_replaces_what_was_foreseen():
    way = Way()
    way.foresee(Travel(-1.0, 0.1, TravelState.MEASURED))
    way.foresee(Travel(-2.0, 0.1, TravelState.MEASURED))
    assert way.distance == 2.0
    way.foresee(Travel(9.0, 0.1, TravelState.UNKNOWN))
    assert way.distance == 0.0
    way.add(Travel(3.0, 0.1, TravelState.MEASURED), 0.5)
    assert way.distance == 3.0 and way.pairs == way.states[TravelState.MEASURED] + 1 == 4
