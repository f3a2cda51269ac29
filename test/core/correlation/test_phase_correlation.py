# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The shift between two frames."""

import cv2
from hypothesis import given, settings, strategies as st
import numpy as np
from phase_traj_ros.core import PhaseCorrelator, Shift
from phase_traj_ros.errors import FrameError
import pytest
from textures import pair

SHAPES = [(120, 160), (121, 161), (96, 243), (240, 320), (187, 621), (375, 1242), (376, 1241)]
DTYPES = [np.uint8, np.uint16, np.float32]


def measure(first, second, **options):
    correlator = PhaseCorrelator(**options)
    assert correlator.update(first) is None
    return correlator.update(second)


@pytest.mark.parametrize('shape', SHAPES, ids=str)
@pytest.mark.parametrize('share', [-0.45, -0.2, -0.01, 0.0, 0.01, 0.2, 0.45])
def test_shift_is_right_to_a_twentieth_of_a_pixel(shape, share):
    for seed, fraction in enumerate((0.0, 0.13, 0.37, 0.5, -0.29)):
        dx = share * (shape[1] - 2) + fraction
        dy = 0.1 * share * shape[0] - fraction
        shift = measure(*pair(shape, dx, dy, seed=seed))
        assert shift.dx == pytest.approx(dx, abs=0.05)
        assert shift.dy == pytest.approx(dy, abs=0.05)


@pytest.mark.parametrize('dtype', DTYPES)
def test_every_type_measures_the_same_shift(dtype):
    shift = measure(*pair((200, 301), 12.3, -4.7, dtype=dtype))
    assert (shift.dx, shift.dy) == (pytest.approx(12.3, abs=0.05), pytest.approx(-4.7, abs=0.05))


@pytest.mark.parametrize('shape', [(75, 75), (375, 625)], ids=str)
def test_odd_sides_have_no_bias_where_cv2_phase_correlate_has_half_a_pixel(shape):
    # OpenCV takes the centre of the map at N / 2, which for an odd size is between two bins.
    first, second = pair(shape, 3.0, 2.0)
    (cv_dx, cv_dy), _ = cv2.phaseCorrelate(
        first.astype(np.float64), second.astype(np.float64),
        cv2.createHanningWindow(shape[::-1], cv2.CV_64F))
    assert (cv_dx, cv_dy) == (pytest.approx(3.5, abs=0.1), pytest.approx(2.5, abs=0.1))
    shift = measure(first, second)
    assert (shift.dx, shift.dy) == (pytest.approx(3.0, abs=0.03), pytest.approx(2.0, abs=0.03))


def test_shift_is_positive_where_the_content_moves_right_and_down():
    frame = np.zeros((64, 96), np.uint8)
    frame[20:30, 30:50] = 200
    moved = np.roll(frame, (4, 9), axis=(0, 1))
    shift = measure(frame, moved)
    assert (shift.dx, shift.dy) == (pytest.approx(9, abs=0.1), pytest.approx(4, abs=0.1))
    assert measure(moved, frame).dx == pytest.approx(-9, abs=0.1)


@pytest.mark.parametrize('dtype', DTYPES)
def test_identical_frames_have_response_one_and_no_shift(dtype):
    frame, _ = pair((150, 201), 0, 0, dtype=dtype)
    shift = measure(frame, frame)
    assert shift.response == pytest.approx(1.0, abs=1e-4)
    assert (shift.dx, shift.dy) == (pytest.approx(0, abs=1e-4), pytest.approx(0, abs=1e-4))


def test_response_is_one_even_where_most_bins_hold_nothing():
    # Stripes have energy in one row of the spectrum only; a box in few bins of it.
    stripes = np.tile((np.arange(200) // 10 % 2 * 200).astype(np.uint8), (100, 1))
    assert measure(stripes, stripes).response == pytest.approx(1.0, abs=1e-3)


def test_unrelated_frames_have_a_low_response():
    first, _ = pair((376, 1241), 0, 0, seed=1)
    second, _ = pair((376, 1241), 0, 0, seed=2)
    assert measure(first, second).response < 0.03


@pytest.mark.parametrize('dtype', DTYPES)
@pytest.mark.parametrize('value', [0, 1, 77, 255])
def test_constant_frame_has_neither_shift_nor_response(dtype, value):
    constant = np.full((100, 101), value, dtype)
    textured, _ = pair((100, 101), 0, 0, dtype=dtype)
    nothing = Shift(0.0, 0.0, 0.0)
    assert measure(constant, constant) == nothing
    assert measure(textured, constant) == nothing
    assert measure(constant, textured) == nothing


def test_shift_does_not_depend_on_scale_and_offset():
    first, second = pair((120, 200), 7.4, 0.0, dtype=np.float32)
    plain = measure(first, second)
    scaled = measure(first * 1e-3 + 5, second * 1e-3 + 5)
    assert scaled.dx == pytest.approx(plain.dx, abs=0.01)


def test_reset_forgets_the_previous_frame():
    first, second = pair((64, 80), 3, 0)
    correlator = PhaseCorrelator()
    correlator.update(first)
    correlator.reset()
    assert correlator.update(second) is None
    assert correlator.update(second).response == pytest.approx(1.0, abs=1e-3)


def test_another_size_restarts_the_correlator():
    correlator = PhaseCorrelator()
    correlator.update(pair((64, 80), 0, 0)[0])
    first, second = pair((70, 90), 5, 0)
    assert correlator.update(first) is None
    assert correlator.update(second).dx == pytest.approx(5, abs=0.05)


def test_strided_frames_give_what_contiguous_ones_give():
    first, second = pair((100, 120), 4.2, 1.1)
    wide = [np.zeros((100, 150), np.uint8) for _ in range(2)]
    for target, frame in zip(wide, (first, second)):
        target[:, 7:127] = frame
    assert measure(wide[0][:, 7:127], wide[1][:, 7:127]) == measure(first, second)


def test_correlation_map_has_its_peak_at_the_shift():
    correlator = PhaseCorrelator()
    for frame in pair((100, 120), -20, 8):
        shift = correlator.update(frame)
    correlation = correlator.correlation_map()
    row, column = np.unravel_index(correlation.argmax(), correlation.shape)
    assert column - correlation.shape[1] // 2 == round(shift.dx) == -20
    assert row - correlation.shape[0] // 2 == round(shift.dy) == 8
    assert correlation.max() == pytest.approx(shift.response, rel=1e-3)


@pytest.mark.parametrize(('frame', 'reason'), [
    (np.zeros((40, 40, 3), np.uint8), 'shape'),
    (np.zeros((40,), np.uint8), 'shape'),
    (np.zeros((40, 40), np.int16), 'int16'),
    (np.zeros((40, 40), np.float64), 'float64'),
    (np.zeros((7, 40), np.uint8), '40x7'),
    (np.zeros((0, 40), np.uint8), '40x0'),
    (np.full((40, 40), np.nan, np.float32), 'NaN'),
    (np.where(np.eye(40), np.inf, 1).astype(np.float32), 'NaN'),
])
def test_unusable_frames_are_refused_and_change_nothing(frame, reason):
    first, second = pair((40, 40), 2, 0)
    correlator = PhaseCorrelator()
    correlator.update(first)
    with pytest.raises(FrameError, match=reason):
        correlator.update(frame)
    assert correlator.update(second).dx == pytest.approx(2, abs=0.1)


@settings(max_examples=60, deadline=None)
@given(
    shape=st.tuples(st.integers(8, 90), st.integers(8, 90)),
    seed=st.integers(0, 2**32 - 1), style=st.sampled_from(['noise', 'sparse', 'flat', 'ramp']))
def test_any_frames_give_finite_shifts_within_the_frame(shape, seed, style):
    rng = np.random.default_rng(seed)
    frames = rng.integers(0, 256, (3, *shape), dtype=np.uint8)
    if style == 'sparse':
        frames[frames < 250] = 0
    elif style == 'flat':
        frames = frames // 128 + 100
    elif style == 'ramp':
        frames = np.broadcast_to(np.arange(shape[1], dtype=np.uint8), (3, *shape))
    correlator = PhaseCorrelator()
    for frame in frames:
        shift = correlator.update(frame)
        if shift is not None:
            assert np.isfinite([shift.dx, shift.dy, shift.response]).all()
            assert 0 <= shift.response <= 1
            assert abs(shift.dx) <= shape[1] and abs(shift.dy) <= shape[0]
