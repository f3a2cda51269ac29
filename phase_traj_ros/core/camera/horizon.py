# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Pitch and roll of the camera relative to the road, which give the horizon.

A vehicle turns about the vertical axis, so the axis of a turn, as seen by the camera, gives both.
The body of a vehicle leans in a turn, to opposite sides in left and right turns.

Image axes are x to the right, y down, z forward. Pitch is positive down and roll is positive right
side down (REP 103).
"""

from dataclasses import asdict, dataclass, replace
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.tuning import TUNING

# That of an exact angle, in square radians.
_LEAST_VARIANCE = 1e-12


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

    def with_given(self, *, pitch_deg: float = 0.0, roll_deg: float = 0.0) -> 'Horizon':
        """Return it with angles that a user gives, in degrees; 0 is not given."""
        horizon = self
        if pitch_deg:
            horizon = replace(
                horizon, pitch=math.radians(pitch_deg), pitch_deviation=TUNING.given_tilt)
        if roll_deg:
            horizon = replace(
                horizon, roll=math.radians(roll_deg), roll_deviation=TUNING.given_tilt)
        return horizon

    def degrees(self) -> dict[str, float]:
        """Return the four angles in degrees, by the names that ``CameraEstimate`` has for them."""
        return {f'{name}_deg': math.degrees(angle) for name, angle in asdict(self).items()}

    def down(self) -> NDArray[np.float64]:
        """Return the downward direction, a unit vector (3,) in image axes."""
        level = math.cos(self.pitch)
        return np.array([
            level * math.sin(self.roll), level * math.cos(self.roll), math.sin(self.pitch)])

    def levelling(self, azimuth: float = 0.0) -> NDArray[np.float64]:
        """
        Return the matrix (3, 3) that rotates the image axes to those of a level camera.

        The level camera points to an ``azimuth`` in radians, positive to the right of this one.
        """
        down = self.down()
        ahead = np.array([0.0, 0.0, 1.0]) - down[2] * down
        ahead /= np.linalg.norm(ahead)
        right = np.cross(down, ahead)
        sine, cosine = math.sin(azimuth), math.cos(azimuth)
        return np.stack([cosine * right - sine * ahead, down, sine * right + cosine * ahead])

    def pitch_along(
        self, course: float, slope: float, *, azimuth: float = 0.0, lean: float = 0.0,
    ) -> float:
        """
        Return the pitch of a camera with this roll whose direction of travel is level.

        The direction has the azimuth ``course``, in radians, positive to the right, and the
        ``slope`` below the optical axis. The vehicle leans by ``lean``, in radians, positive right
        side down, about the ``azimuth`` in which it drives straight ahead.
        """
        below = math.sin(course) * math.sin(self.roll) + slope * math.cos(self.roll)
        ahead = math.cos(course)
        lower = math.tan(lean) * math.sin(course - azimuth) / math.hypot(below, ahead)
        return -math.atan2(below, ahead) - math.asin(min(max(lower, -1.0), 1.0))


class HorizonEstimator:
    """
    Estimates the tilt from turns or recordings, with constant memory.

    Pitch and roll are robust running means, weighted by their variances, with a prior mean of 0.
    """

    def __init__(self) -> None:
        """Start with the prior."""
        self._weight = np.array([TUNING.pitch_deviation, TUNING.roll_deviation]) ** -2
        self._sum = np.zeros(2)

    def add(self, horizon: Horizon) -> None:
        """Add an estimate of the tilt; an angle without deviation is exact."""
        tilt = np.array([horizon.pitch, horizon.roll])
        variance = np.maximum(
            np.square([horizon.pitch_deviation, horizon.roll_deviation]), _LEAST_VARIANCE)
        off = (tilt - self._sum / self._weight) ** 2 / (variance + 1.0 / self._weight)
        weight = 1.0 / (variance * np.maximum(1.0, off / TUNING.outlier_deviations ** 2))
        self._weight += weight
        self._sum += weight * tilt

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
        return Horizon(*(self._sum / self._weight).tolist(), *(self._weight ** -0.5).tolist())
