# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The second peak of the correlation map, and the significance of a peak."""

import tracemalloc

from hypothesis import given, settings, strategies as st
import numpy as np
from phase_traj_ros.core import PhaseCorrelator, Shift
import pytest
from textures import pair

NOTHING = Shift(0.0, 0.0, 0.0)


def correlated(first, second, **options):
    correlator = PhaseCorrelator(**options)
    correlator.update(first)
    return correlator, correlator.update(second)


def two_layers(shape, stronger, weaker, share=0.4):
    """Return frames in which most of the content moves one way and the rest another way."""
    most = pair(shape, *stronger, dtype=np.float32, seed=1)
    some = pair(shape, *weaker, dtype=np.float32, seed=2)
    return [(1 - share) * a + share * b for a, b in zip(most, some)]


@pytest.mark.parametrize('shape', [(120, 160), (121, 243), (240, 320)], ids=str)
@pytest.mark.parametrize(('stronger', 'weaker'), [
    ((0, 0), (23.3, -4.2)), ((-31.4, 2.0), (12.6, 7.3)), ((17.2, 0.4), (-17.2, 0.4))])
def test_the_second_peak_is_what_the_rest_of_the_picture_does(shape, stronger, weaker):
    correlator, first = correlated(*two_layers(shape, stronger, weaker))
    second = correlator.second_peak(apart=6)
    assert (first.dx, first.dy) == (
        pytest.approx(stronger[0], abs=0.15), pytest.approx(stronger[1], abs=0.15))
    assert (second.dx, second.dy) == (
        pytest.approx(weaker[0], abs=0.15), pytest.approx(weaker[1], abs=0.15))
    assert 0 < second.response < first.response


@settings(max_examples=50, deadline=None)
@given(
    shape=st.tuples(st.integers(8, 60), st.integers(8, 60)), seed=st.integers(0, 999),
    apart=st.integers(0, 100), style=st.sampled_from(['unrelated', 'moved', 'identical']))
def test_it_is_the_highest_of_all_that_are_not_near(shape, seed, apart, style):
    rng = np.random.default_rng(seed)
    first = rng.integers(0, 256, shape, dtype=np.uint8)
    second = {'unrelated': rng.integers(0, 256, shape, dtype=np.uint8), 'identical': first,
              'moved': np.roll(first, rng.integers(-8, 9, 2), axis=(0, 1))}[style]
    correlator, _ = correlated(first, second)
    correlation = np.fft.ifftshift(correlator.correlation_map())
    place = np.unravel_index(correlation.argmax(), correlation.shape)
    far = np.zeros(correlation.shape, bool)
    for axis, (index, side) in enumerate(zip(place, correlation.shape)):
        distance = np.abs(np.arange(side) - index)
        distance = np.minimum(distance, side - distance)
        far |= np.expand_dims(distance > min(apart, side // 2 - 1), 1 - axis)
    found = correlator.second_peak(apart=apart)
    highest = correlation[far].max()
    assert found.response == pytest.approx(min(max(highest, 0.0), 1.0), rel=1e-3, abs=1e-6)


def test_queries_change_nothing():
    correlator, first = correlated(*two_layers((120, 160), (5, 0), (-20, 3)))
    before = correlator.correlation_map()
    assert correlator.second_peak(apart=8) == correlator.second_peak(apart=8)
    assert correlator.significance(first) == correlator.significance(first)
    np.testing.assert_array_equal(correlator.correlation_map(), before)
    frame, moved = pair((120, 160), 7, 0)
    other = PhaseCorrelator()
    assert [correlator.update(frame), correlator.update(moved)][1] == [
        other.update(frame), other.update(moved)][1]


def test_queries_allocate_nothing_of_a_frames_size():
    correlator, first = correlated(*pair((376, 1241), 5, 0))
    correlator.second_peak(apart=8)
    tracemalloc.start()
    try:
        correlator.second_peak(apart=8)
        correlator.significance(first)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 376 * 1241 / 10


def test_there_is_nothing_to_see_on_constant_frames():
    constant = np.full((64, 80), 7, np.uint8)
    correlator, shift = correlated(constant, constant)
    assert correlator.second_peak(apart=4) == NOTHING
    assert correlator.significance(shift) == 0.0


@pytest.mark.parametrize('shape', [(100, 120), (240, 320), (376, 1241)], ids=str)
def test_significance_is_in_standard_deviations_of_noise(shape):
    rng = np.random.default_rng(3)
    noise = rng.normal(size=(2, *shape)).astype(np.float32)
    correlator, _ = correlated(*noise)
    places = rng.uniform(-0.5, 0.5, (400, 2)) * shape
    found = [correlator.significance(Shift(dx, dy, 0.0)) for dy, dx in places]
    # The window leaves less noise far from zero than near it; the total is the same.
    assert np.mean(found) == pytest.approx(0.0, abs=0.25)
    assert np.std(found) == pytest.approx(1.0, abs=0.35)


@pytest.mark.parametrize('shape', [(64, 120), (240, 320), (376, 1241)], ids=str)
def test_related_frames_are_significant_and_unrelated_ones_are_not(shape):
    rng = np.random.default_rng(0)
    for seed in range(4):
        first, second = pair(shape, 9.3, -2.1, seed=seed)
        noisy = [np.clip(frame + rng.normal(0, 15, shape), 0, 255).astype(np.uint8)
                 for frame in (first, second)]
        stranger, _ = pair(shape, 0, 0, seed=seed + 100)
        for frames, related in (
                ((first, second), True), (noisy, True), ((first, stranger), False)):
            correlator, shift = correlated(*frames)
            assert (correlator.significance(shift) > 6) == related


def test_significance_can_be_asked_of_any_shift():
    correlator, _ = correlated(*two_layers((240, 320), (0, 0), (30, -4)))
    assert correlator.significance(Shift(30, -4, 0)) > 6
    assert correlator.significance(Shift(-30, 40, 0)) < 5
