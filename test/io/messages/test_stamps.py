# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Header stamps, and the receive times that replace them."""

from types import SimpleNamespace

from phase_traj_ros.io import StampRule, to_nanoseconds
import pytest


@pytest.mark.parametrize(('headers', 'expected'), [
    ([5, 6, 7], [5, 6, 7]),
    # Simulated time starts at zero.
    ([0, 5, 6], [0, 5, 6]),
    # A driver without stamps.
    ([0, 0, 0], [0, 101, 102]),
    # A driver that sets stamps later.
    ([0, 0, 5, 6], [0, 101, 5, 6]),
    # Zeros of a camera that has stamps are left to the gate.
    ([5, 0, 6, 0, 7], [5, 0, 6, 0, 7]),
    ([5, 0, 0, 0, 8], [5, 0, 0, 0, 8]),
    ([0, 0, 5, 0, 6], [0, 101, 5, 0, 6]),
    # This rule does not handle backward jumps.
    ([9, 8, -1], [9, 8, -1]),
])
def test_rule(headers, expected):
    rule = StampRule()
    assert [rule.stamp_ns(stamp, 100 + index) for index, stamp in enumerate(headers)] == expected


def test_rule_that_has_looked_ahead():
    rule = StampRule(zero_seen=True)
    assert [rule.stamp_ns(0, when) for when in (100, 101)] == [100, 101]
    assert rule.stamp_ns(7, 102) == 7
    assert rule.stamp_ns(0, 103) == 0


def test_to_nanoseconds():
    # Exact, where a float would not be.
    time = SimpleNamespace(sec=1_700_000_000, nanosec=123_456_789)
    assert to_nanoseconds(time) == 1_700_000_000_123_456_789
