# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Estimates the camera height in metres, the factor from camera heights to metres."""

import math

from phase_traj_ros.core.camera.tuning import TUNING


class CameraHeight:
    """The camera height, given, estimated from given speeds, or both."""

    def __init__(self, given: float, deviation: float) -> None:
        """Start with a height in metres (0 if unknown) and its relative standard deviation."""
        self._given, self._given_deviation = given, deviation
        self._restart()

    def _restart(self) -> None:
        given = self._given > 0.0
        self._metres = self._given if given else TUNING.usual_height
        self._variance = (self._given_deviation if given else TUNING.height_spread) ** 2
        # The weight of the speeds in the height, from 0 to 1.
        self._share = 0.0

    @property
    def metres(self) -> float | None:
        """Return the height in metres; None if it is unknown."""
        return self._metres if self._given > 0.0 or self._share > 0.0 else None

    @property
    def deviation(self) -> float:
        """Return the relative standard deviation of the height."""
        return float(self._variance ** 0.5)

    def change_lens(self, factor: float, straightened: float, *, assumed: bool) -> None:
        """
        Continue with another lens, after one that was a guess.

        It measures distances in camera heights ``factor`` times as long, and its straightness is
        higher by ``straightened``. What speeds have taught follows the lens; if the previous one
        was only ``assumed``, a height that was given counts again.
        """
        if assumed and self._given > 0.0:
            self._restart()
        else:
            self._metres /= factor ** self._share
            change = self._share * (abs(math.log(factor)) + abs(straightened))
            self._variance += (TUNING.lens_height_error * change) ** 2

    def add(self, metres: float, heights: float, interval: float) -> None:
        """Add the distance of a pair in metres and in camera heights, and its time in seconds."""
        noise = TUNING.height_pair_error ** 2 * max(TUNING.height_pair_time / interval, 1.0)
        gain = self._variance / (self._variance + noise)
        self._metres *= 1.0 + gain * (metres / heights / self._metres - 1.0)
        # The error of the speedometer does not average out. A given height may be more certain.
        least = min(self._variance, TUNING.speedometer_error ** 2)
        self._variance = max(self._variance * (1.0 - gain), least)
        self._share += gain * (1.0 - self._share)
