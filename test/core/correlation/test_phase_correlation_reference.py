# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The fast implementation against a direct one of the equations in float64."""

import numpy as np
from phase_traj_ros.core import PhaseCorrelator
from phase_traj_ros.core.correlation.spectrum import padded_shape
import pytest
from textures import pair


def reference(first, second, shape):
    """Return (dx, dy, response) by eqs. 1 to 3 in float64, transformed at size shape."""
    window = np.outer(*(
        np.sin(np.pi * (np.arange(side) + 0.5) / side) for side in first.shape))
    spectra = [
        np.fft.fft2((frame - frame.mean(dtype=np.float64)) * window, shape)
        for frame in (first, second)]
    cross = np.conj(spectra[0]) * spectra[1]
    correlation = np.fft.ifft2(cross / np.abs(cross)).real
    row, column = np.unravel_index(correlation.argmax(), shape)
    return (
        subpixel(correlation[row], column), subpixel(correlation[:, column], row),
        correlation.max())


def subpixel(line, peak):
    count = len(line)
    slope = (line[(peak + 1) % count] - line[peak - 1]) / line[peak]
    fraction = 0.0 if slope == 0 else (np.sqrt(1 + slope**2) - 1) / slope
    return (peak if peak < count - peak else peak - count) + np.clip(fraction, -0.5, 0.5)


def random_pair(rng):
    shape = (int(rng.integers(24, 140)), int(rng.integers(24, 200)))
    dx, dy = rng.uniform(-0.3, 0.3, 2) * shape[::-1]
    frames = [
        frame.astype(np.float64)
        for frame in pair(shape, dx, dy, seed=int(rng.integers(2**32)))]
    noise = rng.choice([0, 2, 10, 25])
    return [
        np.clip(frame + rng.normal(0, noise, shape), 0, 255).round().astype(np.uint8)
        for frame in frames]


def test_agrees_with_the_equations_in_float64():
    rng = np.random.default_rng(20)
    compared = 0
    for _ in range(200):
        first, second = random_pair(rng)
        correlator = PhaseCorrelator()
        correlator.update(first)
        shift = correlator.update(second)
        dx, dy, response = reference(first, second, padded_shape(first.shape))
        if abs(shift.dx - dx) > 1 or abs(shift.dy - dy) > 1:
            # Two peaks of the same height to seven digits: either may be the highest.
            assert shift.response == pytest.approx(response, rel=1e-5)
            continue
        compared += 1
        assert (shift.dx, shift.dy) == (pytest.approx(dx, abs=0.02), pytest.approx(dy, abs=0.02))
        assert shift.response == pytest.approx(response, abs=1e-4)
    assert compared >= 199


def test_padding_hardly_ever_changes_a_clear_shift():
    rng = np.random.default_rng(21)
    agree = []
    while len(agree) < 200:
        first, second = random_pair(rng)
        dx, dy, response = reference(first, second, first.shape)
        if response > 0.1:
            correlator = PhaseCorrelator()
            correlator.update(first)
            shift = correlator.update(second)
            agree.append(abs(shift.dx - dx) < 0.25 and abs(shift.dy - dy) < 0.25)
    assert np.mean(agree) >= 0.98
