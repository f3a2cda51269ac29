# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Overlays cover the intended areas, and are the same on every frame."""

import numpy as np
import overlays
import pytest

SHAPE = 120, 320
ONE, OTHER = np.random.default_rng(1).integers(0, 256, (2, *SHAPE)).astype(np.uint8)
ALL = {
    'bars': lambda frame: overlays.black_bars(frame, sides=0.1, ends=0.2),
    'bonnet': overlays.bonnet,
    'text': lambda frame: overlays.burnt_in_text(frame, '2026-03-01 12:34'),
    'drops': overlays.drops,
}


@pytest.mark.parametrize('name', ALL)
def test_an_overlay_leaves_its_input_and_the_rest_of_the_frame_alone(name):
    before = ONE.copy()
    over = ALL[name](ONE)
    np.testing.assert_array_equal(ONE, before)
    np.testing.assert_array_equal(ALL[name](ONE), over)
    assert (over.dtype, over.shape) == (np.uint8, SHAPE)
    untouched = over == ONE
    assert 0.4 < untouched.mean() < 0.99
    hidden = ~untouched & (ALL[name](OTHER) != OTHER)
    assert np.abs(over[hidden].astype(int) - ALL[name](OTHER)[hidden]).mean() < 40


def test_bars_are_black_and_as_wide_as_asked_for():
    barred = overlays.black_bars(np.full(SHAPE, 90, np.uint8), sides=0.1, ends=0.2)
    rows, columns = np.flatnonzero(barred.any(axis=1)), np.flatnonzero(barred.any(axis=0))
    assert (rows[0], rows[-1]) == (24, 95)
    assert (columns[0], columns[-1]) == (32, 287)


def test_more_drops_cover_more():
    covered = [
        (overlays.drops(ONE, count=count, seed=2) != ONE).mean() for count in (0, 40, 200)]
    assert covered[0] == 0.0
    assert covered[1] < 0.3 < covered[2]
