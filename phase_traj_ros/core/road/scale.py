# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How high the camera is above the road, in metres: what makes metres of heights."""

# Of the height, as a share of it, where only speeds from elsewhere have told it: speedometers
# and wheels are not better.
_SPEEDOMETER = 0.02
# A pair's two distances differ by this share, standard deviation, for about so many pairs alike.
_PAIR, _ALIKE = 0.1, 10.0
# What nobody has given is something about this, in metres, but for this share.
_USUAL, _SPREAD = 1.5, 0.5


class CameraHeight:
    """A height that was given, that speeds from elsewhere tell, or both."""

    def __init__(self, given: float, deviation: float) -> None:
        """Take the height in metres (0: not known) and its deviation as a share."""
        self._known = given > 0.0
        self._metres = given if self._known else _USUAL
        self._variance = (deviation if self._known else _SPREAD) ** 2

    @property
    def metres(self) -> float | None:
        """Return the height; None as long as nothing has told it."""
        return self._metres if self._known else None

    @property
    def deviation(self) -> float:
        """Return its standard deviation, as a share of it."""
        return float(self._variance ** 0.5)

    def add(self, metres: float, heights: float) -> None:
        """Take a distance in metres that was measured as so many heights, both above 0."""
        noise = _PAIR ** 2 * _ALIKE
        gain = self._variance / (self._variance + noise)
        self._metres *= 1.0 + gain * (metres / heights / self._metres - 1.0)
        # However often it comes, it has the speedometer's error. A given height may be surer.
        least = min(self._variance, _SPEEDOMETER ** 2)
        self._variance = max(self._variance * (1.0 - gain), least)
        self._known = True
