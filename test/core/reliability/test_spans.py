# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Spans that are not reliable are joined, bounded and counted once."""

import numpy as np
from phase_traj_ros.core.reliability.reason import Reason
from phase_traj_ros.core.reliability.tuning import TUNING
from phase_traj_ros.core.reliability.verdict import joined, Reliability, Spans, UnreliableSpan

TENTH = TUNING.part_ns // 10


def test_too_many_spans_are_joined_where_they_are_closest():
    spans = Spans()
    starts = TUNING.part_ns * np.cumsum([10] * 600)
    starts[300:] -= 6 * TUNING.part_ns
    length = 2 * TUNING.part_ns
    for start in starts:
        spans.add(start, start + length)
    kept = spans.of(False, 0, 0)
    assert len(kept) == 500
    assert (starts[299], starts[300] + length) in kept
    assert (kept[0][0], kept[-1][1]) == (starts[0], starts[-1] + length)


def test_spans_that_are_close_are_one_and_empty_ones_are_none():
    spans = Spans()
    for start, end in ((0, 20), (30, 40), (51, 60), (70, 70)):
        spans.add(start * TENTH, end * TENTH)

    def tenths(found):
        return [(start / TENTH, end / TENTH) for start, end in found]

    assert tenths(spans.of(False, 0, 0)) == [(0, 40), (51, 60)]
    assert tenths(spans.of(True, 55 * TENTH, 80 * TENTH)) == [(0, 40), (51, 80)]
    assert [spans.within(begin * TENTH, end * TENTH) / TENTH for begin, end in (
        (0, 60), (10, 55), (40, 51), (-9, 99))] == [49, 34, 0, 49]


def test_spans_of_the_whole_drive_overlap_and_count_once():
    assert joined([(5, 9), (0, 10), (10, 12), (20, 30), (22, 25)]) == [(0, 12), (20, 30)]
    both = (Reason.SHAKING, Reason.FROZEN)
    spans = UnreliableSpan(0, 30, both[:1]), UnreliableSpan(10, 40, both)
    drive = Reliability((), spans, 0, 1000)
    # Together they are 40 of 1000, of which 50 are allowed.
    assert drive.of_drive.reliable
    # Those with a camera that is not known, only in the time in which the vehicle moves.
    second = 1_000_000_000
    for reason, reliable in ((Reason.FROZEN, True), (Reason.CAMERA_NOT_KNOWN, False)):
        spans = (UnreliableSpan(0, 4 * second, (reason,)),)
        drive = Reliability((), spans, 0, 100 * second, 90 * second)
        assert drive.of_drive.reliable == reliable
        assert Reliability((), spans, 0, 100 * second, 20 * second).of_drive.reliable
