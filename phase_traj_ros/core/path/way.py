# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The distance travelled, its unit, and the states of its pairs."""

from collections import Counter
from collections.abc import Mapping
from enum import Enum

from phase_traj_ros.core.road.travel import Travel, TravelState


class LengthUnit(Enum):
    """Unit of distances and of the path."""

    METRE = 'm'
    CAMERA_HEIGHT = 'camera heights'
    """Height of the camera above the road: correct proportions without metres."""
    STEP = 'step'
    """One unit per direction code, or per measured pair."""


class Way:
    """The distance travelled since the start, summed pair by pair."""

    def __init__(self) -> None:
        """Start at distance 0."""
        self._distance = self._foreseen = 0.0
        self.speed: float | None = None
        """Speed of the newest pair, in the unit of the pairs per second; None if unknown."""
        self._states: Counter[TravelState] = Counter()

    def add(self, travel: Travel, interval: float) -> None:
        """Add a pair of ``interval`` seconds; an unknown distance counts as a state only."""
        self._states[travel.state] += 1
        self._foreseen = 0.0
        self.speed = travel.distance / interval if travel.known else None
        if travel.known:
            self._distance += abs(travel.distance)

    def foresee(self, travel: Travel) -> None:
        """Add a distance that the next one replaces."""
        self._states[travel.state] += 1
        self._foreseen = abs(travel.distance) if travel.known else 0.0

    @property
    def pairs(self) -> int:
        """Return the number of pairs."""
        return self._states.total()

    @property
    def measured(self) -> bool:
        """Return whether the distance of a pair was measured on the road."""
        return self._states[TravelState.MEASURED] > 0

    @property
    def distance(self) -> float | None:
        """
        Return the distance travelled, forward and in reverse, in the unit of the pairs.

        It is None if that of each pair is unknown.
        """
        if self.pairs and self._states[TravelState.UNKNOWN] == self.pairs:
            return None
        return self._distance + self._foreseen

    def __str__(self) -> str:
        """Return the distance with one decimal, or that it is unknown."""
        return 'unknown' if self.distance is None else f'{self.distance:.1f}'

    @property
    def states(self) -> Mapping[TravelState, int]:
        """Return the number of pairs in each state."""
        return {state: self._states[state] for state in TravelState}
