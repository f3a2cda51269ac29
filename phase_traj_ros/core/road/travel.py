# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How far a vehicle has gone between two frames."""

from dataclasses import dataclass
from enum import Enum


class TravelState(Enum):
    """How a pair of frames came to its distance."""

    MEASURED = 'measured'
    """The road tells it."""
    BRIDGED = 'bridged'
    """The road cannot be seen or believed: the speed of the pairs before goes on."""
    STANDING = 'standing'
    """The vehicle stands: the distance is exactly 0."""
    GIVEN = 'given'
    """A speed from elsewhere tells it."""
    UNKNOWN = 'unknown'
    """Nothing has told it yet: a unit step without metres, 0 in metres."""


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
    """

    distance: float
    variance: float
    state: TravelState

    @property
    def known(self) -> bool:
        """Return whether there is a distance at all, be it measured, bridged or given."""
        return self.state is not TravelState.UNKNOWN
