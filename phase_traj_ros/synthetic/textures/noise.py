# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Noise with the spectrum of natural textures, the base of all surfaces."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from phase_traj_ros.synthetic.arrays import Floats, Singles

#: Size of a noise image of the bank, in pixels.
_SIZE = 1024


def spectral_noise(rng: np.random.Generator, height: int, width: int, *, slope: float) -> Singles:
    """
    Return noise of shape (height, width) whose amplitude is 1 / frequency ** slope.

    It has mean 0 and standard deviation 1 and is periodic. A slope of 0 is white noise, 1 is that
    of natural images, 2 looks like clouds.
    """
    spectrum = np.fft.rfft2(rng.standard_normal((height, width)))
    spectrum *= _amplitudes(height, width, slope)
    noise = np.fft.irfft2(spectrum, (height, width))
    normalised: Singles = (noise / noise.std()).astype(np.float32)
    return normalised


# Every town has noise of the same five kinds.
@lru_cache(maxsize=5)
def _amplitudes(height: int, width: int, slope: float) -> Floats:
    """Return 1 / frequency ** slope, and 0 for the mean."""
    frequency = np.hypot(np.fft.fftfreq(height)[:, None], np.fft.rfftfreq(width)[None, :])
    frequency[0, 0] = 1.0
    amplitudes: Floats = frequency ** -slope
    amplitudes[0, 0] = 0.0
    return amplitudes


def noise_bank(rng: np.random.Generator) -> dict[float, Singles]:
    """Return large noises by their slope: white (0), fine (0.5), natural (1) and soft (2)."""
    return {
        slope: spectral_noise(rng, _SIZE, _SIZE, slope=slope) for slope in (0.0, 0.5, 1.0, 2.0)}


@dataclass(frozen=True, slots=True)
class Sheet:
    """A surface to be drawn: its size in metres, pixels per metre, and the sources of chance."""

    rng: np.random.Generator
    bank: dict[float, Singles]
    length: float
    height: float
    density: float

    @property
    def shape(self) -> tuple[int, int]:
        """Return the number of rows and columns."""
        return (round(self.height * self.density), round(self.length * self.density))

    def noise(self, slope: float, *, down: int = 1, across: int = 1) -> Singles:
        """Return noise of the whole sheet, stretched by these factors: a part of the bank's."""
        (rows, columns) = self.shape
        (top, left) = self.rng.integers(_SIZE, size=2)
        # The noise is periodic.
        patch: Singles = self.bank[slope][np.ix_(
            np.arange(top, top + rows // down) % _SIZE,
            np.arange(left, left + columns // across) % _SIZE)]
        return patch if down == across else np.asarray(cv2.resize(patch, (columns, rows)))
