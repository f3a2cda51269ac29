# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Locates an odometry on a road map."""

from phase_traj_ros.core.localization.estimate import LocationEstimate
from phase_traj_ros.core.localization.given import OdometryStep, PositionFix, Prior, ScaleRange
from phase_traj_ros.core.localization.roads import RoadMap
from phase_traj_ros.core.localization.settings import LocatorSettings


class MapLocator:
    """
    Finds where on a road map a vehicle is, from its odometry alone.

    Hypotheses about the place follow the odometry along the roads. Those whose roads bend
    otherwise than the odometry lose weight. The random numbers have a fixed seed, so equal input
    gives equal output.
    """

    def __init__(
        self, roads: RoadMap, *, scale: ScaleRange | None = None, prior: Prior | None = None,
        settings: LocatorSettings | None = None, seed: int = 0,
    ) -> None:
        """
        Make a locator.

        Parameters
        ----------
        roads
            The map.
        scale
            Metres per unit of the odometry; None for an odometry in metres within 5 %.
        prior
            Where the vehicle starts; None for anywhere on the map.
        settings
            The tuning; None for the defaults.
        seed
            Seed of the random numbers.

        Raises
        ------
        ValueError
            No road is within the prior.

        """
        raise NotImplementedError

    def update(self, step: OdometryStep) -> LocationEstimate:
        """
        Take the next step of the odometry; return the place after it.

        The hypotheses are judged every 5 m. Steps between only move the last estimate.
        """
        raise NotImplementedError

    def fix(self, fix: PositionFix) -> bool:
        """
        Take a position at the newest pose; return whether it was used.

        A fix that contradicts the claimed place, its own covariance and the odometry since is not
        used, unless the next ones agree with it.
        """
        raise NotImplementedError

    def interrupt(self, distance: float, *, turn: float = 0.0) -> None:
        """
        Report a gap, a cut or a reset of the odometry: the vehicle may have moved unseen.

        Parameters
        ----------
        distance
            Largest distance that the vehicle may have driven meanwhile, in metres.
        turn
            Standard deviation of the unseen change of the heading in radians; pi or more if
            nothing is known of it, as after a reset.

        Raises
        ------
        ValueError
            An argument is negative or not finite.

        """
        raise NotImplementedError
