# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs the locator over the odometry of a drive, and records its estimates."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
import math

from phase_traj_ros.core.localization.estimate import Candidate, LocationEstimate
from phase_traj_ros.core.localization.given import OdometryStep, Prior, ScaleRange
from phase_traj_ros.core.localization.locator import MapLocator
from phase_traj_ros.core.localization.settings import LocatorSettings
from phase_traj_ros.errors import MapError
from phase_traj_ros.io.maps.road_file import RoadFile
from phase_traj_ros.tasks.location.motion import Interruption, Motion
from phase_traj_ros.tasks.location.odometry import DriveOdometry

UNKNOWN = LocationEstimate(
    0, claimed=False, x=math.nan, y=math.nan, heading=math.nan, probability=0.0,
    covariance=((math.inf, 0.0, 0.0), (0.0, math.inf, 0.0), (0.0, 0.0, math.inf)), scale=math.nan,
    scale_deviation=math.inf)
"""The estimate before the first step, and between an interruption and the next step."""


@dataclass(frozen=True, slots=True)
class Near:
    """A rough position: within ``radius`` metres of a point in degrees."""

    latitude: float
    longitude: float
    radius: float

    def prior(self, roads: RoadFile) -> Prior:
        """
        Return the prior in metres of a map.

        Raises
        ------
        MapError
            No road of the map is within the radius.

        """
        x, y = roads.projection.to_metres(self.latitude, self.longitude).tolist()
        # A point on the other hemisphere is NaN metres away.
        if not roads.road_map.distance_to(x, y) <= self.radius:
            south, west, north, east = roads.bounds
            raise MapError(
                f'no road of {roads.source} is within {self.radius:g} m of {self.latitude:g},'
                f'{self.longitude:g}: the map covers latitudes {south:.4f} to {north:.4f} and'
                f' longitudes {west:.4f} to {east:.4f}')
        return Prior(x, y, self.radius)


@dataclass(frozen=True, slots=True)
class LocatedPose:
    """
    A pose of a drive, and the estimate of its place.

    stamp_ns
        Stamp in nanoseconds.
    driven
        Distance since the first pose, forwards and in reverse, in the unit of the odometry.
    estimate
        Estimate of the locator.
    """

    stamp_ns: int
    driven: float
    estimate: LocationEstimate


@dataclass(frozen=True, slots=True)
class Located:
    """A located drive, with the arguments of ``locate``."""

    odometry: DriveOdometry
    roads: RoadFile
    near: Near | None
    scale: ScaleRange
    level: float
    poses: tuple[LocatedPose, ...]

    @property
    def first_claim(self) -> LocatedPose | None:
        """Return the first pose whose place is known; None if there is none."""
        return next((pose for pose in self.poses if pose.estimate.claimed), None)

    @property
    def tracks(self) -> list[list[LocatedPose]]:
        """Return the runs of successive poses whose place is known."""
        return [
            list(part) for known, part in groupby(
                self.poses, key=lambda pose: pose.estimate.claimed) if known]

    def degrees(self, place: LocationEstimate | Candidate) -> tuple[float, float]:
        """Return the latitude and longitude of a place in degrees."""
        latitude, longitude = self.roads.projection.to_degrees(place.x, place.y)
        return float(latitude), float(longitude)


def locate(
    odometry: DriveOdometry, roads: RoadFile, *, near: Near | None = None,
    scale: ScaleRange | None = None, level: float | None = None,
    advance: Callable[[], object] = lambda: None,
) -> Located:
    """
    Locate a drive on a map.

    Parameters
    ----------
    odometry
        The drive.
    roads
        The map.
    near
        Where it starts; None for anywhere on the map.
    scale
        Metres per unit of the odometry; None for ``odometry.scale``.
    level
        Probability above which a place is claimed; None for the default.
    advance
        Called after each pose.

    Raises
    ------
    MapError
        No road of the map is within ``near``.

    """
    scale = odometry.scale if scale is None else scale
    settings = LocatorSettings() if odometry.link is None else LocatorSettings.of_links(
        odometry.link * scale.middle)
    settings = settings if level is None else replace(settings, claim_above=level)
    locator = MapLocator(
        roads.road_map, scale=scale, prior=None if near is None else near.prior(roads),
        settings=settings)
    driven = 0.0
    poses = [LocatedPose(odometry.stamps_ns[0], 0.0, UNKNOWN)]
    for stamp_ns, motions in zip(odometry.stamps_ns[1:], odometry.motions):
        estimate = feed(locator, motions)
        driven += sum(
            abs(motion.distance) for motion in motions if isinstance(motion, OdometryStep))
        poses.append(LocatedPose(stamp_ns, driven, estimate))
        advance()
    return Located(odometry, roads, near, scale, settings.claim_above, tuple(poses))


def feed(locator: MapLocator, motions: Sequence[Motion]) -> LocationEstimate:
    """Feed the motions of a pair to a locator; return the estimate after the last one."""
    estimate = UNKNOWN
    for motion in motions:
        if isinstance(motion, Interruption):
            locator.interrupt(motion.distance, turn=motion.turn)
            estimate = UNKNOWN
        else:
            estimate = locator.update(motion)
    return estimate
