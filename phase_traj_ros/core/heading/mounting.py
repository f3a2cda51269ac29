# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Estimates the azimuth at which a camera is mounted, from the direction of travel on straights.

A vehicle goes where it points, and its camera points a little aside. If each pair of frames
expected the travel straight ahead of the camera, each would turn a share of that angle into yaw,
always in one direction.
"""

import math

from phase_traj_ros.core.heading.camera_motion import MOUNTED

# Standard deviation, in radians, of the direction of travel about the mounting, and the time in
# seconds for which it is correlated.
_SCATTER, _ALIKE = math.radians(1.0), 1.0
# Change of the mounting in radians within a time in seconds, as that of the pitch.
_MOVED, _MOVING = math.radians(0.3), 600.0
# A vehicle drives straight ahead below this yaw rate, in radians per second.
_STRAIGHT = math.radians(3.0)


class Mounting:
    """The azimuth of the direction of travel of a vehicle that drives straight ahead."""

    def __init__(self) -> None:
        """Start with a camera that points straight ahead."""
        self.angle = 0.0
        """In radians, positive to the right, as the azimuth of the direction of travel."""
        self._variance = MOUNTED ** 2

    @property
    def deviation(self) -> float:
        """Return its standard deviation in radians."""
        return math.sqrt(self._variance)

    def add(self, course: float, variance: float, interval: float, yaw_rate: float) -> None:
        """
        Add the direction of travel of a pair of frames.

        Parameters
        ----------
        course
            Its azimuth in radians.
        variance
            Its variance.
        interval
            Seconds between the frames, above 0.
        yaw_rate
            Yaw rate in radians per second; in a turn, a camera moves sideways.

        """
        self._variance += _MOVED ** 2 * min(interval / _MOVING, 1.0)
        if abs(yaw_rate) > _STRAIGHT:
            return
        noise = (_SCATTER ** 2 + variance) * max(_ALIKE / interval, 1.0)
        gain = self._variance / (self._variance + noise)
        self.angle += gain * (course - self.angle)
        self._variance *= 1.0 - gain
