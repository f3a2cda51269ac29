# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Samples of a drive, one every third of a second: reduced images and their gradients."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.correlation.view import halvings, reduced
from phase_traj_ros.core.fixed.tuning import TUNING

# A number for each pixel or cell, (h, w), or several of these arrays, (N, h, w).
Plane = NDArray[np.float32]
# Energy of both gradients of white noise of variance 1: two times the sum of the squared weights.
_SOBEL_NOISE = 2.0 * 12.0 / 64.0


class PictureSamples:
    """Keeps the two newest samples of frames of one size, and compares them."""

    def __init__(self, shape: tuple[int, int]) -> None:
        """Make an empty sampler for frames of ``shape`` (H, W)."""
        self._times = 1 << halvings(shape, pixels=TUNING.pixels, least=TUNING.min_side)
        self.shape = height, width = shape[0] // self._times, shape[1] // self._times
        """Size of the reduced images, (h, w)."""
        self.diagonal = math.hypot(height, width)
        cell = TUNING.cell_share * self.diagonal
        across, down = (max(round(side / cell), 1) for side in (width, height))
        self._cells = across, down
        self.picture: Plane = np.zeros((height, width), np.float32)
        """The newest sample, (h, w), scaled to a mean brightness of 100."""
        self.gradients: Plane = np.zeros((4, height, width), np.float32)
        """Its gradients to the right and downwards (length 1 if strong), their energy, and what
        noise adds to it."""
        self._previous = self.gradients
        self.turned = 0.0
        """Sideways shift since the previous sample, in reduced pixels, without sign."""
        self.elapsed = 0.0
        """Seconds since the previous sample."""
        self.blank = False
        """Whether the newest sample holds only sensor noise."""
        self._differences: Plane | None = None
        self.interrupt()

    def interrupt(self) -> None:
        """Do not compare the next frame with earlier ones; it becomes the first sample."""
        self._primed, self._elapsed, self._shift = False, 0.0, 0.0

    def take(self, frame: Frame, interval: float, turned: float) -> bool:
        """Take the next frame; return whether it completed a new pair of samples."""
        self._elapsed += interval
        self._shift += turned
        if self._primed and self._elapsed < TUNING.period_s:
            return False
        self.turned = abs(self._shift) / self._times
        self.elapsed, self._elapsed, self._shift = self._elapsed, 0.0, 0.0
        picture = reduced(frame, self._times, self._times)
        level = cv2.mean(picture)[0]
        gain = TUNING.brightness / level if level > 0.0 else 1.0
        self.picture = np.multiply(picture, np.float32(gain), dtype=np.float32)
        self._previous, self.gradients = self.gradients, _differentiated(
            self.picture, noise=gain * self._noise(frame) / self._times)
        left = self.cell_means(self.picture).std()
        self.blank = bool(left <= TUNING.noise_share * self.picture.std())
        primed, self._primed = self._primed, True
        return primed

    def changes(self, since: Plane | None = None) -> tuple[Plane, Plane, Plane]:
        """
        Return the change of the gradients' energy, and the energy of both samples, by cells.

        The change is since the previous sample, or since the gradients ``since``, (4, h, w). The
        third array is what noise adds to either.
        """
        before = self._previous if since is None else since
        step = self.gradients[:2] - before[:2]
        np.square(step, out=step)
        _, _, energy, noise = self.gradients + before
        if since is None:
            # It is measured between the two: a stream that hung had none before.
            noise = 2.0 * self.gradients[3]
        return (self.cell_means(step[0] + step[1]), self.cell_means(energy),
                self.cell_means(noise))

    def _noise(self, frame: Frame) -> float:
        """
        Return the standard deviation of a frame's noise, in its grey levels.

        It is from the median of the differences of diagonals, to which the scene adds little
        (Donoho and Johnstone, "Ideal spatial adaptation by wavelet shrinkage", Biometrika 1994). A
        pattern that stays, such as that of a dithered image, is not noise: it differs far less
        from that of the previous sample.
        """
        every = TUNING.noise_rows * self._times
        upper, lower = (np.asarray(frame[row::every], np.float32) for row in range(2))
        before, differences = self._differences, np.diff(upper[:len(lower)] - lower, axis=1)
        self._differences = differences
        median = float(np.median(np.abs(differences)))
        if before is not None:
            # Not the smaller one: in the dark, both are 0 or 1 grey level.
            passing = float(np.median(np.abs(differences - before))) / math.sqrt(2.0)
            median = passing if passing < TUNING.staying_share * median else median
        return median / (2.0 * 0.6745)

    def enlarged(self, values: NDArray[np.uint8], shape: tuple[int, int]) -> NDArray[np.uint8]:
        """Return values of a sample's pixels, (h, w), for those of a frame of this shape."""
        height, width = (self._times * side for side in self.shape)
        large = cv2.resize(values, (width, height), interpolation=cv2.INTER_NEAREST)
        # What remains on the right and at the bottom is in no sample.
        return cv2.copyMakeBorder(  # type: ignore[return-value]
            large, 0, shape[0] - height, 0, shape[1] - width, cv2.BORDER_REPLICATE)

    def cell_means(self, values: Plane) -> Plane:
        """Return the means of values (h, w) over the cells, of which there are a few thousand."""
        return cv2.resize(  # type: ignore[return-value]
            values, self._cells, interpolation=cv2.INTER_AREA)


def _differentiated(picture: Plane, *, noise: float) -> Plane:
    """
    Return the ``PictureSamples.gradients`` of a sample.

    ``noise`` is its standard deviation, in grey levels.
    """
    across = cv2.Sobel(picture, cv2.CV_32F, 1, 0, scale=0.125)
    down = cv2.Sobel(picture, cv2.CV_32F, 0, 1, scale=0.125)
    energy = across * across + down * down
    soft = TUNING.gradient_energy_share * cv2.mean(energy)[0] + TUNING.noise_levels ** 2
    length = np.sqrt(energy + soft)
    # The mean of the share that noise adds, if the energy is that of noise alone.
    added = _SOBEL_NOISE * noise ** 2
    return np.stack([
        across / length, down / length, energy / (energy + soft),
        added / (energy + soft + added)])
