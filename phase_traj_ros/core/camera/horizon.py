# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
How the camera is tilted against the road: its pitch and roll, and so where the horizon is.

A vehicle turns about the vertical, so the axis of a turn, seen by the camera, tells both. A
vehicle that drives straight on goes along the road, so the direction of travel tells the pitch
once more. Bodies lean in a turn, to one side in a left one and to the other in a right one.

Picture axes are x to the right, y down, z forward. Pitch is positive nose down and roll positive
right side down, as REP 103 has it.
"""

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.lens_family import OneNumberLens, radius
from phase_traj_ros.core.camera.robust_mean import RobustMean

# What is known of cameras beforehand, radians: most are mounted nearly level.
_PITCH, _ROLL = math.radians(8.0), math.radians(3.0)
# How far the axis of a turn is from the vertical: vehicles lean, and roads do.
_TURN_PITCH, _TURN_ROLL = math.radians(1.0), math.radians(2.0)
# The same for the direction of travel, and how many pairs that follow each other tell no more
# than one.
_TRAVEL, _ALIKE = math.radians(0.5), 30.0


@dataclass(frozen=True, slots=True)
class Horizon:
    """
    The tilt of the camera, in radians.

    pitch, roll
        Nose down and right side down positive.
    pitch_deviation, roll_deviation
        Standard deviations of what they may be.
    """

    pitch: float = 0.0
    roll: float = 0.0
    pitch_deviation: float = _PITCH
    roll_deviation: float = _ROLL

    def row(self, lens: OneNumberLens, height: int) -> float:
        """Return the row of the horizon in the middle of pictures of so many rows."""
        above = float(radius(np.array([abs(self.pitch)]), lens.straightness)[0])
        return (height - 1) / 2 - math.copysign(lens.focal_px * above, self.pitch)

    def down(self) -> NDArray[np.float64]:
        """Return which way is down, a unit vector (3,) in picture axes."""
        level = math.cos(self.pitch)
        return np.array([
            level * math.sin(self.roll), level * math.cos(self.roll), math.sin(self.pitch)])

    def levelling(self) -> NDArray[np.float64]:
        """Return the rotation (3, 3) from the camera's picture axes to those of a level one."""
        down = self.down()
        ahead = np.array([0.0, 0.0, 1.0]) - down[2] * down
        ahead /= np.linalg.norm(ahead)
        return np.stack([np.cross(down, ahead), down, ahead])


class HorizonEstimator:
    """Learns the tilt from turns and from driving straight on; its memory does not grow."""

    def __init__(self) -> None:
        """Make an estimator that has seen nothing."""
        self._pitch, self._roll = RobustMean(_PITCH), RobustMean(_ROLL)

    def add_turn(self, down: NDArray[np.float64], deviation: float = 0.0) -> None:
        """
        Take the axis of a turn.

        Parameters
        ----------
        down
            (3,) unit vector in picture axes, of the two directions the one downwards.
        deviation
            How well it is measured, in radians.

        """
        self._pitch.add(
            math.asin(min(max(float(down[2]), -1.0), 1.0)), math.hypot(_TURN_PITCH, deviation))
        self._roll.add(
            math.atan2(float(down[0]), float(down[1])), math.hypot(_TURN_ROLL, deviation))

    def add_travel(self, slope: float, deviation: float) -> None:
        """
        Take the direction in which the vehicle goes while it drives straight on, of one pair.

        Parameters
        ----------
        slope
            Tangent of its angle below the optical axis.
        deviation
            How well it is measured, in radians.

        """
        self._pitch.add(
            -math.atan(slope), math.hypot(_TRAVEL, deviation) * math.sqrt(_ALIKE))

    @property
    def horizon(self) -> Horizon:
        """Return what is known by now."""
        return Horizon(
            self._pitch.mean, self._roll.mean, self._pitch.deviation, self._roll.deviation)


def combined(horizons: list[Horizon]) -> Horizon:
    """Return what several recordings of one camera tell together."""
    pitch, roll = RobustMean(_PITCH), RobustMean(_ROLL)
    for horizon in horizons:
        pitch.add(horizon.pitch, horizon.pitch_deviation)
        roll.add(horizon.roll, horizon.roll_deviation)
    return Horizon(pitch.mean, roll.mean, pitch.deviation, roll.deviation)
