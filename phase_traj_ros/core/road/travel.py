# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How far a vehicle has gone between two frames."""

from dataclasses import dataclass, replace
from enum import Enum
import math


class TravelState(Enum):
    """How a pair of frames came to its distance."""

    MEASURED = 'measured'
    """The road tells it."""
    BRIDGED = 'bridged'
    """The road cannot be seen or believed: the speed of the pairs before goes on, for seconds."""
    STANDING = 'standing'
    """The vehicle stands: the distance is exactly 0."""
    GIVEN = 'given'
    """A speed from elsewhere tells it."""
    UNKNOWN = 'unknown'
    """
    Nothing has told it yet, or not for long: 0 in metres.

    Without metres, the path goes on with a unit step, or with the last speed.
    """


@dataclass(frozen=True, slots=True)
class Travel:
    """
    What one pair of frames adds to the way.

    The unit is that of the path along the heading: metres where the settings are metric
    (``EstimatorSettings.metric``), else heights of the camera above the road.

    distance
        Along the way, negative in reverse.
    variance
        Of the distance, in squares of its unit.
    state
        How it was found.
    swing, tilt, scale
        Parts of the variance that are alike from pair to pair, as standard deviations in shares of
        the distance: for about a second (the springs), for about a minute (the camera's pitch),
        and for the whole drive (its height, or a speedometer).
    """

    distance: float
    variance: float
    state: TravelState
    swing: float = 0.0
    tilt: float = 0.0
    scale: float = 0.0

    @property
    def known(self) -> bool:
        """Return whether there is a distance at all, be it measured, bridged or given."""
        return self.state is not TravelState.UNKNOWN

    @property
    def own_variance(self) -> float:
        """Return the part of the variance that has nothing to do with other pairs."""
        shares = self.swing ** 2 + self.tilt ** 2 + self.scale ** 2
        return max(self.variance - shares * self.distance ** 2, 0.0)

    def scaled(self, factor: float, deviation: float) -> 'Travel':
        """Return it in a unit that is smaller by a factor, known but for a share of it."""
        distance = factor * self.distance
        return replace(
            self, distance=distance, scale=math.hypot(self.scale, deviation),
            variance=factor ** 2 * self.variance + (deviation * distance) ** 2)
