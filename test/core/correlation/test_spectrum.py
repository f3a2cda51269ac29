# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Transform sizes, and cross-phase spectra in the packed layout."""

import cv2
from hypothesis import given, strategies as st
import numpy as np
from phase_traj_ros.core.correlation.spectrum import CrossPhase, padded_side, ROUNDING
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
    # A change would change the shifts of all recordings slightly.
    assert padded_side(length) == side


@pytest.mark.parametrize('shape', [(8, 8), (64, 80), (72, 16), (136, 250), (720, 640)])
def test_cross_phase_is_the_product_of_unit_spectra(shape):
    rng = np.random.default_rng(0)
    pictures = [rng.normal(size=shape).astype(np.float32) for _ in range(3)]
    units = [spectrum / np.abs(spectrum) for spectrum in map(np.fft.fft2, pictures)]
    cross = CrossPhase(shape)
    for number, picture in enumerate(pictures):
        spectrum = cv2.dft(picture)
        assert cross(spectrum, 1.0) == 1.0
        product = np.fft.fft2(cv2.dft(spectrum, flags=cv2.DFT_INVERSE | cv2.DFT_SCALE))
        expected = units[number] * np.conj(units[number - 1]) if number else 0.0
        np.testing.assert_allclose(product, expected, atol=1e-3)


def test_after_a_spectrum_without_content_the_product_is_zero():
    spectra = [cv2.dft(np.random.default_rng(seed).normal(size=(64, 80)).astype(np.float32))
               for seed in (0, 1)]
    cross = CrossPhase((64, 80))
    cross(spectra[0], 1.0)
    cross.clear()
    cross(spectra[1], 1.0)
    assert not spectra[1].any()


def test_bins_below_the_floor_stay_weak_and_are_counted():
    shape = (64, 80)
    rng = np.random.default_rng(1)
    full = np.fft.rfft2(rng.normal(size=shape))
    full[:, 20:] *= 1e-9
    spectrum = cv2.dft(np.fft.irfft2(full, shape).astype(np.float32))
    energy = CrossPhase(shape)(spectrum, 1.0 / ROUNDING)
    # Column frequencies 0 to 19 survive; all but the first stand for two bins each.
    assert energy == pytest.approx((1 + 2 * 19) / 80, abs=0.01)
