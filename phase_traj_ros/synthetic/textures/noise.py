# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Random textures with a natural spectrum, the stuff all surfaces are made of."""

import numpy as np
from phase_traj_ros.synthetic.arrays import Singles


def spectral_noise(
    rng: np.random.Generator, height: int, width: int, *, slope: float,
) -> Singles:
    """
    Return noise of shape (height, width) whose amplitude falls as 1 / frequency ** slope.

    Its mean is 0 and its standard deviation 1; it continues seamlessly over its edges. A slope
    of 0 is white, 1 is what natural pictures have, 2 is soft as clouds.
    """
    spectrum = np.fft.rfft2(rng.standard_normal((height, width)))
    frequency = np.hypot(np.fft.fftfreq(height)[:, None], np.fft.rfftfreq(width)[None, :])
    frequency[0, 0] = 1.0
    spectrum *= frequency ** -slope
    spectrum[0, 0] = 0.0
    noise = np.fft.irfft2(spectrum, (height, width))
    normalised: Singles = (noise / noise.std()).astype(np.float32)
    return normalised


class NoiseBank:
    """A few large noises, made once, of which any number of patches are cut."""

    def __init__(self, rng: np.random.Generator, *, size: int = 1024) -> None:
        """Make the noises: white, fine (slope 0.5), natural (1) and soft (2)."""
        self._rng = rng
        self._size = size
        self._noises = {
            slope: spectral_noise(rng, size, size, slope=slope) for slope in (0.0, 0.5, 1.0, 2.0)}

    def patch(self, height: int, width: int, *, slope: float) -> Singles:
        """Return a random patch of shape (height, width); larger ones than the bank repeat."""
        (top, left) = self._rng.integers(self._size, size=2)
        rows = np.arange(top, top + height) % self._size
        columns = np.arange(left, left + width) % self._size
        patch: Singles = self._noises[slope][np.ix_(rows, columns)]
        return patch
