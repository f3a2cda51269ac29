# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The route of the vehicle: its drawn path, distance, equal links and odometry."""

from phase_traj_ros.core.codes.chain import Step
from phase_traj_ros.core.codes.freeman import AnyDirection
from phase_traj_ros.core.codes.links import LinkCode
from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.path.heading_path import DrawnPath, HeadingPath
from phase_traj_ros.core.path.odometry import Odometer, Odometry
from phase_traj_ros.core.path.trajectory import ChainPath
from phase_traj_ros.core.path.way import Way
from phase_traj_ros.core.road.travel import Travel
from phase_traj_ros.core.settings import EstimatorSettings


class Route:
    """Grows with each pair of frames, along the direction and along the heading."""

    def __init__(self, settings: EstimatorSettings) -> None:
        """Make a route that has not started; its sources do not change later."""
        along_heading = settings.draws_heading
        self._heading_path = HeadingPath(max_corners=settings.max_corners if along_heading else 1)
        self._odometer = Odometer(self._heading_path) if settings.metric else None
        self.drawn: DrawnPath = (
            self._heading_path if along_heading else ChainPath(max_corners=settings.max_corners))
        self.way = Way()
        """Distance travelled."""
        self.links: LinkCode | None = None
        """The chain code of equal links, if the settings ask for it."""
        if settings.code_step > 0:
            self.links = LinkCode(
                settings.code_step, connectivity=settings.connectivity,
                max_runs=settings.max_runs)

    def start(self, stamp_ns: int) -> None:
        """Start at the origin, on a route that has not started."""
        self.drawn.start(stamp_ns)

    def add(
        self, step: Step, heading: HeadingStep | None, travel: Travel | None, stamp_ns: int,
        interval_ns: int, *, interval_deviation: float = 0.0,
    ) -> tuple[Odometry | None, tuple[AnyDirection, ...]]:
        """
        Add a pair of frames: its codes, and its heading and distance if they are measured.

        Return its odometry, None if the distance is not known in metres, and the directions of
        the equal links that end with it. ``interval_deviation`` is that of its interval, in s.
        """
        if step.appended and isinstance(self.drawn, ChainPath):
            self.drawn.append(step.direction, stamp_ns)
        if heading is None or travel is None:
            return None, ()
        interval = interval_ns * 1e-9
        self.way.add(travel, interval)
        links: tuple[AnyDirection, ...] = ()
        if self.links is not None and travel.known:
            links = self.links.add(travel.distance, heading.heading, heading.yaw)
        if self._odometer is not None:
            return self._odometer.update(
                heading, travel, stamp_ns, interval,
                interval_deviation=interval_deviation), links
        self._heading_path.append(heading.heading, heading.yaw, travel.distance, stamp_ns)
        return None, links

    def foresee(
        self, step: Step, heading: HeadingStep, travel: Travel | None, stamp_ns: int,
        interval_ns: int,
    ) -> Odometry | None:
        """
        Move on to a frame that is not measured, and return its odometry.

        ``heading`` and ``travel`` are those since the newest pair, ``interval_ns`` before; the
        next one replaces them.
        """
        if step.appended and isinstance(self.drawn, ChainPath):
            self.drawn.append(step.direction, stamp_ns)
        if travel is None:
            return None
        self.way.foresee(travel)
        if self._odometer is not None:
            return self._odometer.foresee(heading, travel, stamp_ns, interval_ns * 1e-9)
        self._heading_path.foresee(heading.heading, heading.yaw, travel.distance, stamp_ns)
        return None
