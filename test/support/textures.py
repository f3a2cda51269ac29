# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Realistic textures, shifted cyclically by exact fractions of a pixel."""

import numpy as np


def spectrum(shape, seed):
    """Return the spectrum of a random texture whose power falls off as in natural images."""
    rng = np.random.default_rng(seed)
    rows = np.fft.fftfreq(shape[0])[:, None]
    columns = np.fft.rfftfreq(shape[1])[None]
    frequency = np.hypot(rows, columns)
    frequency[0, 0] = np.inf
    noise = rng.normal(size=frequency.shape) + 1j * rng.normal(size=frequency.shape)
    return noise / frequency**1.2


def shifted(texture, shape, dx, dy):
    """Return the texture moved by dx to the right and dy down, cyclically."""
    rows = np.fft.fftfreq(shape[0])[:, None]
    columns = np.fft.rfftfreq(shape[1])[None]
    return np.fft.irfft2(texture * np.exp(-2j * np.pi * (columns * dx + rows * dy)), shape)


def pair(shape, dx, dy, *, dtype=np.uint8, seed=0):
    """Return two frames, the content of the second moved by (dx, dy) pixels."""
    texture = spectrum(shape, seed)
    first, second = shifted(texture, shape, 0, 0), shifted(texture, shape, dx, dy)
    scale = 40 / first.std()
    if dtype == np.float32:
        return first.astype(dtype), second.astype(dtype)
    unit = np.iinfo(dtype).max / 255
    return tuple(
        np.clip((each * scale + 128) * unit, 0, np.iinfo(dtype).max).round().astype(dtype)
        for each in (first, second))
