# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Masks over fixed areas."""

import numpy as np
from phase_traj_ros.core import PhaseCorrelator
from phase_traj_ros.core.correlation.mask import mask_weights
from phase_traj_ros.errors import FrameError
import pytest
from textures import pair

SHAPE = (120, 200)


def half_open():
    mask = np.full(SHAPE, 255, np.uint8)
    mask[:, :100] = 0
    return mask


@pytest.mark.parametrize('form', [
    lambda mask: mask, lambda mask: mask // 255, lambda mask: mask > 0,
    lambda mask: mask / 255.0, lambda mask: mask.astype(np.uint16) * 7])
def test_only_the_ratio_of_the_weights_counts(form):
    weights = mask_weights(form(half_open()))
    assert weights.dtype == np.float32
    np.testing.assert_allclose(weights, mask_weights(half_open()))


def test_the_edge_is_soft_and_what_is_masked_out_stays_out():
    weights = mask_weights(half_open())
    row = weights[60]
    assert not row[:100].any()
    assert 0 < row[100] < 0.5
    assert (np.diff(row) >= 0).all()
    assert row[105:].min() == 1.0


def test_a_mask_without_anything_masked_out_is_left_as_it_is():
    ramp = np.linspace(0.2, 1.0, SHAPE[1], dtype=np.float32) * np.ones(SHAPE, np.float32)
    np.testing.assert_allclose(mask_weights(ramp), ramp)


@pytest.mark.parametrize(('mask', 'reason'), [
    (np.ones((4, 4, 3)), 'shape'),
    (np.ones(4), 'shape'),
    (np.zeros((4, 4)), 'empty'),
    (np.zeros((0, 4)), 'empty'),
    (np.array([[1.0, np.nan]]), 'NaN'),
    (np.array([[1.0, np.inf]]), 'NaN'),
    (np.array([[1.0, -0.1]]), 'negative'),
])
def test_invalid_masks_are_refused(mask, reason):
    with pytest.raises(ValueError, match=reason):
        PhaseCorrelator(mask=mask)


def through_a_dirty_window(dx):
    """Return a pair of frames with sharp fixed spots, and their mask."""
    rng = np.random.default_rng(0)
    first, second = pair(SHAPE, dx, 0)
    mask = np.full(SHAPE, 255, np.uint8)
    for _ in range(30):
        top, left = rng.integers(0, SHAPE[0] - 12), rng.integers(0, SHAPE[1] - 12)
        spot = slice(top, top + 12), slice(left, left + 12)
        mask[spot] = 0
        first[spot] = second[spot] = rng.integers(0, 256, (12, 12))
    return first, second, mask


def shift_of(first, second, mask=None):
    correlator = PhaseCorrelator(mask=mask)
    correlator.update(first)
    return correlator.update(second)


def test_a_mask_frees_the_peak_that_a_fixed_pattern_locks():
    first, second, mask = through_a_dirty_window(21.4)
    assert shift_of(first, second).dx == pytest.approx(0, abs=0.5)
    assert shift_of(first, second, mask).dx == pytest.approx(21.4, abs=0.3)


def test_the_masks_own_edge_does_not_lock_the_peak():
    # The darker the image around the masked area, the sharper a hard edge would be.
    first, second, mask = through_a_dirty_window(21.4)
    for frame in (first, second):
        frame //= 2
        frame[:, 120:] += 127
    assert shift_of(first, second, mask).dx == pytest.approx(21.4, abs=0.3)


def test_a_mask_that_leaves_all_changes_nothing():
    first, second = pair(SHAPE, 7.3, -2.0)
    shift = shift_of(first, second, np.ones(SHAPE))
    plain = shift_of(first, second)
    assert (shift.dx, shift.dy) == (
        pytest.approx(plain.dx, abs=0.01), pytest.approx(plain.dy, abs=0.01))
    assert shift.response == pytest.approx(plain.response, abs=0.01)


def test_the_unmasked_part_may_be_constant():
    first, _ = pair(SHAPE, 0, 0)
    first[half_open() > 0] = 90
    assert shift_of(first, first, half_open()).response == pytest.approx(0.0, abs=1e-3)


def test_a_frame_of_another_size_says_both_sizes_and_changes_nothing():
    first, second = pair(SHAPE, 5, 0)
    correlator = PhaseCorrelator(mask=half_open())
    correlator.update(first)
    with pytest.raises(FrameError, match=r'frame is 199x120 .* mask 200x120'):
        correlator.update(first[:, 1:])
    assert correlator.update(second).dx == pytest.approx(5, abs=0.1)
