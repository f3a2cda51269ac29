# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where the vehicle is: the estimate and its candidates.

Positions are in the metres of the map, x to the east and y to the north. Headings are in radians
from -pi to pi, counter-clockwise from the east.
"""

from dataclasses import dataclass
import math

Covariance = tuple[
    tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


@dataclass(frozen=True, slots=True)
class Candidate:
    """A place where the vehicle may be, with the probability that it is near it."""

    x: float
    y: float
    heading: float
    probability: float


@dataclass(frozen=True, slots=True)
class LocationEstimate:
    """
    The most probable place after a step of the odometry.

    stamp_ns
        Stamp of the step.
    claimed
        Whether the place counts as known: the probability has been high enough for long enough.
        Do not use the place as a position otherwise.
    x, y, heading
        The most probable place and heading, also while nothing is claimed.
    probability
        Probability that the vehicle is near this place: within 35 m and 25 degrees, by default.
        What is left is the probability of other places and of being on no road of the map.
    covariance
        Covariance of x, y and heading, (3, 3), in metres and radians, given that the vehicle is
        near this place.
    scale, scale_deviation
        Metres per unit of the odometry, and the standard deviation, likewise.
    candidates
        The most probable places, the best first, at most as many as the settings say; empty if the
        vehicle is certainly on no road of the map.
    off_road
        Probability of being on no road of the map.
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
    off_road: float = 0.0

    @property
    def standard_deviation(self) -> float:
        """Return the standard deviation of the position: the root mean square of x and y."""
        return math.sqrt((self.covariance[0][0] + self.covariance[1][1]) / 2)
