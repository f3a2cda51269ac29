# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The distance travelled between two frames."""

from dataclasses import dataclass, replace
from enum import Enum
import math


class TravelState(Enum):
    """Source of the distance of a pair."""

    MEASURED = 'measured'
    """The distance is measured on the road."""
    BRIDGED = 'bridged'
    """The road could not be measured: the last speed continues, for seconds."""
    STANDING = 'standing'
    """The vehicle stands: the distance is 0, with the variance of an invisible creep."""
    GIVEN = 'given'
    """The distance comes from a given speed."""
    UNKNOWN = 'unknown'
    """
    No speed was measured yet, or none for long: the distance is 0 in metres.

    Without metres, the path continues with one unit, or with the last speed.
    """


@dataclass(frozen=True, slots=True)
class Travel:
    """
    Distance of one pair of frames.

    The unit is that of the path along the heading: metres if the settings are metric
    (``EstimatorSettings.metric``), else camera heights.

    distance
        Distance along the path, negative in reverse.
    variance
        Variance of the distance, in squares of its unit.
    state
        Source of the distance.
    swing, tilt, scale
        Relative standard deviations of the errors that are correlated between pairs: for about a
        second (suspension), for about a minute (pitch of the camera), and for the whole drive
        (camera height, or speedometer).
    rivalled
        Whether another motion is more significant on all of the road, while the vehicle drives, or
        the road has slid the other way than by a given speed for more than a second.
    rests
        Whether the road is in the same place as before, whatever moves above it.
    covered
        Whether something has come over the view of a vehicle that drives.
    refuted
        For how long before the pair, in seconds, the speed was that of noise, as the pair shows.
    """

    distance: float
    variance: float
    state: TravelState
    swing: float = 0.0
    tilt: float = 0.0
    scale: float = 0.0
    rivalled: bool = False
    rests: bool = False
    covered: bool = False
    refuted: float = 0.0

    @property
    def known(self) -> bool:
        """Return whether the distance is known: measured, bridged, given or standing."""
        return self.state is not TravelState.UNKNOWN

    @property
    def measured(self) -> bool:
        """Return whether the distance is that of this pair: measured, given or standing."""
        return self.known and self.state is not TravelState.BRIDGED

    @property
    def by_road(self) -> bool:
        """Return whether the distance comes from the road: measured on it, or bridged."""
        return self.state in (TravelState.MEASURED, TravelState.BRIDGED)

    @property
    def own_variance(self) -> float:
        """Return the part of the variance that is independent of other pairs."""
        return max(self.variance - self._shared * self.distance ** 2, 0.0)

    @property
    def _shared(self) -> float:
        """Return the relative variance of the errors that are correlated between pairs."""
        return self.swing ** 2 + self.tilt ** 2 + self.scale ** 2

    def part(self, distance: float, share: float) -> 'Travel':
        """Return a part of it with this distance, and a share of its own variance."""
        variance = share * self.own_variance + self._shared * distance ** 2
        return replace(self, distance=distance, variance=variance)

    def scaled(self, factor: float, deviation: float) -> 'Travel':
        """Return the distance times a factor with a relative standard deviation."""
        distance = factor * self.distance
        return replace(
            self, distance=distance, scale=math.hypot(self.scale, deviation),
            variance=factor ** 2 * self.variance + (deviation * distance) ** 2)
