# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The hint on a threshold that does not fit, with a suggestion."""

import numpy as np
from phase_traj_ros.core.codes.threshold_hint import Misfit, ShiftSummary
import pytest

WIDTH, INTERVAL = 320, 0.05


def shifts(*parts, noise=0.3, seed=1):
    """Return the shifts of straights (0) and turns, (shift, pairs) each, with noise."""
    series = np.concatenate([np.full(count, float(shift)) for shift, count in parts])
    return series + np.random.default_rng(seed).normal(0, noise, len(series))


TURNS = shifts((0, 100), (8.5, 60), (0, 100), (-8.5, 60), (0, 80))


def hint(series, threshold, width=WIDTH, interval=INTERVAL):
    summary = ShiftSummary()
    for dx in series:
        summary.add(dx, threshold, interval=interval)
    return summary.hint(width)


@pytest.mark.parametrize('threshold', [2.0, 4.0, 6.0])
def test_a_threshold_that_fits_is_left_alone(threshold):
    assert hint(TURNS, threshold) is None


@pytest.mark.parametrize('threshold', [12.0, 16.0, 60.0])
def test_a_threshold_that_nothing_reaches_is_too_high(threshold):
    given = hint(TURNS, threshold)
    assert given.misfit is Misfit.TOO_HIGH
    largest_px = 2.0 * given.suggested_px
    assert largest_px == pytest.approx(8.7, abs=0.4)
    assert hint(TURNS, given.suggested_px) is None
    assert given.sentence == (
        f'no lasting shift reached the threshold of {threshold:.3g} px, the largest was'
        f' {largest_px:.2g} px: if the vehicle turned, try code_source auto, or a threshold'
        f' of about {given.suggested_px:.2g} px')


def test_a_single_wrong_shift_does_not_make_a_threshold_fit():
    series = TURNS.copy()
    series[50] = -70.0
    assert hint(series, 16.0).misfit is Misfit.TOO_HIGH
    assert hint(series, 16.0).suggested_px < 5.0


def test_a_single_short_interval_does_not_make_a_turn():
    summary = ShiftSummary()
    for number in range(40):
        summary.add(0.6, 16.0, interval=0.005 if number == 20 else 0.1)
    assert summary.hint(WIDTH) is None


@pytest.mark.parametrize('threshold', [0.5, 4.0, 16.0])
def test_a_straight_drive_gives_no_reason_to_lower_the_threshold(threshold):
    assert hint(shifts((0, 200), noise=0.1), threshold) is None


def test_a_threshold_below_the_shifts_of_straights_is_too_low():
    given = hint(TURNS, 0.15)
    assert given.misfit is Misfit.TOO_LOW
    assert int(given.sentence.split()[0]) > 60
    assert hint(TURNS, given.suggested_px) is None
    assert 'too many for turns: try code_source auto, or a threshold of about' in given.sentence


def test_without_a_turn_no_threshold_is_suggested():
    given = hint(shifts((0, 200), noise=0.3), 0.1)
    assert (given.misfit, given.suggested_px) == (Misfit.TOO_LOW, None)
    assert given.sentence.endswith('try code_source auto')


def test_a_threshold_at_the_height_of_the_turns_makes_the_codes_flicker():
    given = hint(TURNS, 8.6)
    assert given.misfit is Misfit.FLICKERING
    assert hint(TURNS, given.suggested_px) is None
    assert 'most turns end as soon as they begin' in given.sentence


def test_unmeasured_pairs_do_not_count_and_few_pairs_give_no_hint():
    assert hint(TURNS[95:112], 16.0) is None
    summary = ShiftSummary()
    for number, dx in enumerate(TURNS):
        if number % 4 == 3:
            summary.miss()
        else:
            summary.add(dx, 16.0, interval=INTERVAL)
    assert summary.hint(WIDTH) is None
