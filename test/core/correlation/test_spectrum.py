# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Transform sizes and whitening in the packed layout."""

import cv2
from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core.correlation.spectrum import padded_side, Whitener
import pytest


@given(st.integers(8, 5000))
def test_padded_side_follows_its_rule(length):
    side = padded_side(length)
    assert side % 8 == 0
    assert side == length or side - length >= 4
    assert side % 1024
    assert side == length or side % 256
    assert side <= 1.25 * length + 16
    for factor in (2, 3, 5):
        while side % factor == 0:
            side //= factor
    assert side == 1


@pytest.mark.parametrize(('length', 'side'), [
    (8, 8), (9, 16), (240, 240), (376, 384), (480, 480), (1080, 1080), (1226, 1296),
    (1241, 1296), (1242, 1296), (1280, 1280), (1920, 1920), (2048, 2160)])
def test_padded_sides_are_pinned(length, side):
    # Whoever changes one changes the shifts, by a little, of everybody's recordings.
    assert padded_side(length) == side


@pytest.mark.parametrize('shape', [(8, 8), (64, 80), (72, 16), (136, 250)])
def test_whitening_scales_every_bin_to_one(shape):
    picture = np.random.default_rng(0).normal(size=shape).astype(np.float32)
    spectrum = cv2.dft(picture)
    assert Whitener(shape)(spectrum, 1e-6) == 1.0
    whitened = np.fft.fft2(cv2.dft(spectrum, flags=cv2.DFT_INVERSE | cv2.DFT_SCALE))
    expected = np.fft.fft2(picture)
    np.testing.assert_allclose(whitened, expected / np.abs(expected), atol=1e-3)


def test_bins_below_the_floor_stay_weak_and_are_counted():
    shape = (64, 80)
    rng = np.random.default_rng(1)
    full = np.fft.rfft2(rng.normal(size=shape))
    full[:, 20:] *= 1e-9
    spectrum = cv2.dft(np.fft.irfft2(full, shape).astype(np.float32))
    energy = Whitener(shape)(spectrum, 1.0)
    # Column frequencies 0 to 19 survive; all but the first stand for two bins each.
    assert energy == pytest.approx((1 + 2 * 19) / 80, abs=0.01)
