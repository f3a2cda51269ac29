# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Pitch and roll of the camera relative to the road, which give the horizon.

A vehicle turns about the vertical axis, so the axis of a turn, as seen by the camera, gives both.
A vehicle that drives straight ahead moves along the road, so the direction of travel also gives
the pitch. The body of a vehicle leans in a turn, to opposite sides in left and right turns.

Image axes are x to the right, y down, z forward. Pitch is positive down and roll is positive right
side down (REP 103).
"""

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.lens_family import OneNumberLens, radius
from phase_traj_ros.core.camera.robust_mean import RobustMean
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

    def row(self, lens: OneNumberLens, height: int) -> float:
        """Return the row of the horizon at the centre column of images with ``height`` rows."""
        above = float(radius(np.array([abs(self.pitch)]), lens.straightness)[0])
        return (height - 1) / 2 - math.copysign(lens.focal_px * above, self.pitch)

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
    """Estimates the tilt from turns and straight driving, with constant memory."""

    def __init__(self) -> None:
        """Start with the prior."""
        self._pitch = RobustMean(TUNING.pitch_deviation)
        self._roll = RobustMean(TUNING.roll_deviation)

    def add_turn(self, down: NDArray[np.float64], deviation: float = 0.0) -> None:
        """
        Add the axis of a turn.

        Parameters
        ----------
        down
            Downward unit vector along the axis, (3,), in image axes.
        deviation
            Standard deviation of the measurement, in radians.

        """
        self._pitch.add(
            math.asin(min(max(float(down[2]), -1.0), 1.0)),
            math.hypot(TUNING.turn_pitch, deviation))
        self._roll.add(
            math.atan2(float(down[0]), float(down[1])), math.hypot(TUNING.turn_roll, deviation))

    def add_travel(self, slope: float, deviation: float) -> None:
        """
        Add the direction of travel of one pair while the vehicle drives straight ahead.

        Parameters
        ----------
        slope
            Tangent of its angle below the optical axis.
        deviation
            Standard deviation of the measurement, in radians.

        """
        self._pitch.add(
            -math.atan(slope),
            math.hypot(TUNING.travel_deviation, deviation) * math.sqrt(TUNING.alike_pairs))

    @property
    def horizon(self) -> Horizon:
        """Return the current estimate."""
        return Horizon(
            self._pitch.mean, self._roll.mean, self._pitch.deviation, self._roll.deviation)


def combined(horizons: list[Horizon]) -> Horizon:
    """Combine the estimates of several recordings of one camera."""
    pitch, roll = RobustMean(TUNING.pitch_deviation), RobustMean(TUNING.roll_deviation)
    for horizon in horizons:
        pitch.add(horizon.pitch, horizon.pitch_deviation)
        roll.add(horizon.roll, horizon.roll_deviation)
    return Horizon(pitch.mean, roll.mean, pitch.deviation, roll.deviation)
