# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The path along the measured heading."""

import math

from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core.path.heading_path import HeadingPath
import pytest

YAWS = st.lists(st.floats(-0.5, 0.5), max_size=200)


def driven(yaws, *, length=1.0, **options):
    path, heading = HeadingPath(**options), 0.0
    path.start(0)
    for index, yaw in enumerate(yaws):
        heading += yaw
        path.append(heading, yaw, length, index + 1)
    return path


def test_straight_ahead_is_along_x():
    tip = driven([0.0] * 5, length=2.0).tip
    assert (tip.x, tip.y, tip.yaw, tip.stamp_ns) == (10.0, 0.0, 0.0, 5)


def test_a_circle_to_the_left_closes_on_the_left():
    path = driven([math.tau / 100] * 100)
    assert (path.tip.x, path.tip.y) == pytest.approx((0, 0), abs=1e-9)
    assert path.tip.yaw == pytest.approx(math.tau)
    assert max(corner.y for corner in path.corners) == pytest.approx(100 / math.pi, rel=1e-3)
    assert min(corner.y for corner in path.corners) == pytest.approx(0, abs=1e-9)


def test_backwards_and_on_the_spot():
    assert driven([0.0] * 3, length=-1.0).tip.x == -3.0
    tip = driven([0.1] * 3, length=0.0).tip
    assert (tip.x, tip.y, tip.yaw) == (0.0, 0.0, pytest.approx(0.3))


def test_a_step_goes_along_the_middle_of_its_own_yaw():
    # The heading that was lost and found again between two steps is none of the second's.
    path = HeadingPath()
    path.append(0.0, 0.0, 1.0, 1)
    path.append(math.pi / 2, 0.0, 1.0, 2)
    assert (path.tip.x, path.tip.y) == pytest.approx((1.0, 1.0))


@given(YAWS, st.integers(1, 20))
def test_a_bounded_path_is_the_whole_one_thinned(yaws, kept):
    whole, bounded = driven(yaws), driven(yaws, max_corners=kept)
    assert bounded.tip == whole.tip
    assert len(bounded.corners) <= kept
    assert set(bounded.corners) <= set(whole.corners)
    # So what a replay, which keeps all, writes is what the node publishes.
    assert bounded.points(kept + 1) == whole.points(kept + 1)
    assert all(np.diff([corner.stamp_ns for corner in whole.points(kept + 1)]) > 0)
    if yaws:
        assert whole.points(kept + 1)[0].stamp_ns == 0


def test_standing_still_does_not_push_out_the_way():
    path = HeadingPath(max_corners=50)
    for index in range(100):
        path.append(0.0, 0.0, 1.0, index)
    before = path.corners
    for index in range(100, 5000):
        path.append(0.1, 0.0, 0.0, index)
    assert path.corners == before
    assert (path.tip.x, path.tip.yaw, path.tip.stamp_ns) == (100.0, 0.1, 4999)


def test_before_the_start_and_before_the_first_step():
    path = HeadingPath(max_corners=3)
    assert path.points(2) == () == path.corners
    path.start(7)
    assert [corner.stamp_ns for corner in path.points(2)] == [7]
    path.append(0.0, 0.0, 1.0, 8)
    assert [corner.stamp_ns for corner in path.points(2)] == [7, 8]
