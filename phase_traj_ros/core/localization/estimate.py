# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The estimate of the locator and its candidates.

Positions are in the metres of the map, x to the east and y to the north. Headings are in radians
from -pi to pi, counter-clockwise from the east.
"""

from dataclasses import dataclass
import math

from phase_traj_ros.core.path.odometry import Covariance


@dataclass(frozen=True, slots=True)
class Candidate:
    """A place where the vehicle may be, and the probability that it is near it."""

    x: float
    y: float
    heading: float
    probability: float


@dataclass(frozen=True, slots=True)
class LocationEstimate:
    """
    The most probable place after a step of the odometry.

    stamp_ns
        Stamp of the step in nanoseconds.
    claimed
        Whether the place is known: its probability has been high enough for long enough.
        Otherwise, do not use it as a position.
    x, y, heading
        The most probable place and heading, whether or not it is claimed.
    probability
        Probability that the vehicle is near this place: within 35 m and 25 degrees, by default.
        The rest is the probability of other places and of no road of the map.
    covariance
        Covariance of x, y and heading, (3, 3), in metres and radians, provided that the vehicle
        is near this place.
    scale, scale_deviation
        Metres per unit of the odometry, and the standard deviation, under the same condition.
    candidates
        The most probable places, best first, at most ``LocatorSettings.most_candidates``.
    """

    stamp_ns: int
    claimed: bool
    x: float
    y: float
    heading: float
    probability: float
    covariance: Covariance
    scale: float
    scale_deviation: float
    candidates: tuple[Candidate, ...] = ()

    @property
    def standard_deviation(self) -> float:
        """Return the standard deviation of the position in metres: the RMS of those of x and y."""
        return math.sqrt((self.covariance[0][0] + self.covariance[1][1]) / 2)
