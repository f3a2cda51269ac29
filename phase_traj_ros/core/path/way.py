# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How long the way is, in which unit, and how its distances were found."""

from collections import Counter
from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType

from phase_traj_ros.core.road.travel import Travel, TravelState


class LengthUnit(Enum):
    """What lengths of the way and of the path are in."""

    METRE = 'm'
    CAMERA_HEIGHT = 'camera heights'
    """Heights of the camera above the road: true proportions, without metres."""
    STEP = 'step'
    """One for each direction code, or for each measured pair."""


class Way:
    """The way since the start, added up pair by pair."""

    def __init__(self) -> None:
        """Make a way of length 0."""
        self._states: Counter[TravelState] = Counter()
        self.reset()

    def reset(self) -> None:
        """Go back to length 0."""
        self._distance = 0.0
        self._speed: float | None = None
        self._states.clear()

    def add(self, travel: Travel, interval: float) -> None:
        """Add a pair of ``interval`` seconds; one that is not known counts, and has no length."""
        self._states[travel.state] += 1
        self._speed = travel.distance / interval if travel.known else None
        if travel.known:
            self._distance += abs(travel.distance)

    @property
    def pairs(self) -> int:
        """Return how many pairs were added."""
        return self._states.total()

    @property
    def distance(self) -> float:
        """Return the length, reverse driving included, in the unit of the travels."""
        return self._distance

    @property
    def speed(self) -> float | None:
        """Return the newest pair's speed, in that unit per second; None if it is not known."""
        return self._speed

    @property
    def states(self) -> Mapping[TravelState, int]:
        """Return how many pairs came to their distance in which way."""
        return MappingProxyType({state: self._states[state] for state in TravelState})
