# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Pitch and roll of the camera relative to the road, which give the horizon.

A vehicle turns about the vertical axis, so the axis of a turn, as seen by the camera, gives both.
The body of a vehicle leans in a turn, to opposite sides in left and right turns.

Image axes are x to the right, y down, z forward. Pitch is positive down and roll is positive right
side down (REP 103).
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.tuning import TUNING


@dataclass(frozen=True, slots=True)
class Horizon:
    """
    The tilt of the camera, in radians.

    pitch, roll
        Positive down, and positive right side down.
    pitch_deviation, roll_deviation
        Their standard deviations.
    """

    pitch: float = 0.0
    roll: float = 0.0
    pitch_deviation: float = TUNING.pitch_deviation
    roll_deviation: float = TUNING.roll_deviation

    def degrees(self) -> dict[str, float]:
        """Return the four angles in degrees, by the names that ``CameraEstimate`` has for them."""
        return {f'{name}_deg': math.degrees(angle) for name, angle in asdict(self).items()}

    def down(self) -> NDArray[np.float64]:
        """Return the downward direction, a unit vector (3,) in image axes."""
        level = math.cos(self.pitch)
        return np.array([
            level * math.sin(self.roll), level * math.cos(self.roll), math.sin(self.pitch)])

    def levelling(self) -> NDArray[np.float64]:
        """Return the matrix (3, 3) that rotates the image axes to those of a level camera."""
        down = self.down()
        ahead = np.array([0.0, 0.0, 1.0]) - down[2] * down
        ahead /= np.linalg.norm(ahead)
        return np.stack([np.cross(down, ahead), down, ahead])


class HorizonEstimator:
    """Estimates the tilt from turns, with constant memory."""

    def __init__(self) -> None:
        """Start with the prior."""
        self._pitch = _RobustMean(TUNING.pitch_deviation)
        self._roll = _RobustMean(TUNING.roll_deviation)

    def add(self, horizon: Horizon) -> None:
        """Add an estimate of the tilt."""
        self._pitch.add(horizon.pitch, horizon.pitch_deviation)
        self._roll.add(horizon.roll, horizon.roll_deviation)

    def add_turn(self, down: NDArray[np.float64], deviation: float = 0.0) -> None:
        """
        Add the axis of a turn.

        ``down`` is the downward unit vector along it, (3,), in image axes, and ``deviation`` the
        standard deviation of the measurement, in radians.
        """
        x, y, z = down.tolist()
        self.add(Horizon(
            math.asin(min(max(z, -1.0), 1.0)), math.atan2(x, y),
            math.hypot(TUNING.turn_pitch, deviation), math.hypot(TUNING.turn_roll, deviation)))

    @property
    def horizon(self) -> Horizon:
        """Return the current estimate."""
        return Horizon(
            self._pitch.mean, self._roll.mean, self._pitch.deviation, self._roll.deviation)


def combined(horizons: Sequence[Horizon]) -> Horizon:
    """Combine the estimates of several recordings of one camera."""
    estimator = HorizonEstimator()
    for horizon in horizons:
        estimator.add(horizon)
    return estimator.horizon


class _RobustMean:
    """The running mean of values with different deviations, with a prior mean of 0."""

    def __init__(self, deviation: float) -> None:
        self._weight, self._sum = deviation ** -2, 0.0

    @property
    def mean(self) -> float:
        return self._sum / self._weight

    @property
    def deviation(self) -> float:
        return float(self._weight ** -0.5)

    def add(self, value: float, deviation: float) -> None:
        """Add a value with its standard deviation, above 0."""
        variance = deviation * deviation
        off = (value - self.mean) ** 2 / (variance + 1.0 / self._weight)
        weight = 1.0 / (variance * max(1.0, off / TUNING.outlier_deviations ** 2))
        self._weight += weight
        self._sum += weight * value
