# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What can go wrong with stamps, injected over real DDS."""

import math

from coded import codes, complete, send
import pytest
from test_node import rolled, SECOND, START


def test_a_gap_is_no_movement_and_keeps_the_direction(shared_live, tuned):
    node = tuned({'max_gap': 0.5})
    send(node, rolled([0, 0, 30, 60, 90, 90]), [0, 0.1, 0.2, 5.0, 5.1, 5.2])
    shared_live.until(lambda: complete(node, 5))
    assert codes(node) == ([1, 0, 3, 0, 1], ['ok', 'ok', 'gap', 'ok', 'ok'])
    assert math.isnan(node['shift'][2].vector.x)


def test_repeated_stamps_are_dropped(shared_live, tuned):
    node = tuned()
    send(node, rolled([0, 0, 30, 30, 60]), [0, 0.1, 0.1, 0.1, 0.2])
    shared_live.until(lambda: complete(node, 2))
    assert codes(node)[0] == [1, 0]
    assert node['shift'][1].vector.x == pytest.approx(60, abs=0.2)
    send(node, rolled([60] * 15), [0.2] * 15)
    shared_live.until_said('repeats one image, or one stamp')


@pytest.mark.parametrize('bad', [0.49, 3600.0, -START / SECOND, -3600.0])
def test_a_stamp_out_of_order_costs_its_image_only(shared_live, tuned, bad):
    node = tuned()
    positions = [0, 0, 0, 0, 0, 0, 90, 30, 30, 30]
    stamps = [0, 0.1, 0.2, 0.3, 0.4, 0.5, bad, 0.7, 0.8, 0.9]
    send(node, rolled(positions), stamps)
    shared_live.until(lambda: complete(node, 8))
    assert codes(node) == ([1, 1, 1, 1, 1, 0, 1, 1], ['ok'] * 8)


def test_a_dropped_image_is_told(live, run):
    node = run()
    send(node, rolled([0, 0, 0, 0]), [0, 0.1, 0.05, 0.2])
    live.until(lambda: complete(node, 2))
    live.until_said('images dropped so far: 1, with stamps that are late, or far')


def test_a_dropped_frame_does_not_make_a_turn_where_the_period_is_known(shared_live, tuned):
    positions, stamps = [0, 10, 20, 40, 50], [0, 0.1, 0.2, 0.4, 0.5]
    node = tuned({'shift.nominal_period': 0.1})
    send(node, rolled(positions), stamps)
    shared_live.until(lambda: complete(node, 4))
    assert codes(node)[0] == [1, 1, 1, 1]
    assert node['shift'][2].vector.x == pytest.approx(20, abs=0.2)


def test_without_a_period_a_dropped_frame_doubles_the_shift(shared_live, tuned):
    node = tuned()
    send(node, rolled([0, 10, 20, 40, 50]), [0, 0.1, 0.2, 0.4, 0.5])
    shared_live.until(lambda: complete(node, 4))
    assert codes(node)[0] == [1, 1, 0, 1]
