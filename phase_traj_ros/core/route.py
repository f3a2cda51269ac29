# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The route of the vehicle: its drawn path, distance, equal links and odometry."""

from dataclasses import dataclass

from phase_traj_ros.core.codes.chain import Step
from phase_traj_ros.core.codes.freeman import AnyDirection
from phase_traj_ros.core.codes.links import LinkCode
from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.path.heading_path import HeadingPath
from phase_traj_ros.core.path.odometry import Odometer, Odometry
from phase_traj_ros.core.path.trajectory import ChainPath, DrawnPath
from phase_traj_ros.core.path.way import Way
from phase_traj_ros.core.road.travel import Travel
from phase_traj_ros.core.settings import EstimatorSettings


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of the route by a pair of frames."""

    odometry: Odometry | None = None
    """Pose and motion in metres; None if the distance is not known in metres."""
    links: tuple[AnyDirection, ...] = ()
    """Directions of the equal links that end with this pair."""


class Route:
    """Grows with each pair of frames, along the direction or along the heading."""

    def __init__(self, settings: EstimatorSettings) -> None:
        """Make a route that has not started; its sources do not change later."""
        from_heading = settings.draws_heading
        self._chain_path = ChainPath(max_corners=settings.max_corners)
        self._odometer: Odometer | None = None
        if settings.metric:
            self._odometer = Odometer(max_corners=settings.max_corners if from_heading else 1)
        self._heading_path: HeadingPath | None = None
        if self._odometer is not None:
            self._heading_path = self._odometer.path
        elif settings.measures_distance:
            self._heading_path = HeadingPath(max_corners=settings.max_corners)
        self.way = Way()
        """Distance travelled."""
        self.links: LinkCode | None = None
        """The chain code of equal links, if the settings ask for it."""
        if settings.code_step > 0:
            self.links = LinkCode(
                settings.code_step, connectivity=settings.connectivity,
                max_runs=settings.max_runs)
        self.drawn: DrawnPath = self._chain_path
        if from_heading and self._heading_path is not None:
            self.drawn = self._heading_path

    def reset(self) -> None:
        """Go back to the origin."""
        for part in (
                self._chain_path, self._heading_path, self._odometer, self.way, self.links):
            if part is not None:
                part.reset()

    def start(self, stamp_ns: int) -> None:
        """Start at the origin, on a route that has not started."""
        self._chain_path.start(stamp_ns)
        if self._heading_path is not None:
            self._heading_path.start(stamp_ns)

    def add(
        self, step: Step, heading: HeadingStep | None, travel: Travel | None, stamp_ns: int,
        interval_ns: int, *, unsure_ns: float = 0.0,
    ) -> Progress:
        """
        Add a pair of frames, and return its progress.

        Parameters
        ----------
        step
            The codes of the pair.
        heading
            Its change of the heading; None if the heading is not measured.
        travel
            Its distance; None if no distance is measured.
        stamp_ns
            Stamp of its second frame.
        interval_ns
            Time since its first frame.
        unsure_ns
            Its standard deviation.

        """
        if step.appended:
            self._chain_path.append(step.direction, stamp_ns)
        if heading is None or travel is None:
            return Progress()
        interval = interval_ns * 1e-9
        self.way.add(travel, interval)
        return Progress(
            self._go(heading, travel, stamp_ns, interval, unsure_ns * 1e-9),
            self._link(heading, travel))

    def foresee(
        self, step: Step, heading: HeadingStep, travel: Travel | None, stamp_ns: int,
        interval_ns: int,
    ) -> Odometry | None:
        """
        Move on to a frame that is not measured, and return its odometry.

        ``heading`` and ``travel`` are those since the newest pair, ``interval_ns`` before; the
        next one replaces them.
        """
        if step.appended:
            self._chain_path.append(step.direction, stamp_ns)
        if travel is None:
            return None
        self.way.foresee(travel)
        if self._odometer is not None:
            return self._odometer.foresee(heading, travel, stamp_ns, interval_ns * 1e-9)
        if self._heading_path is not None:
            self._heading_path.foresee(heading.heading, heading.yaw, travel.distance, stamp_ns)
        return None

    def _go(
        self, heading: HeadingStep, travel: Travel, stamp_ns: int, interval: float,
        unsure: float,
    ) -> Odometry | None:
        if self._odometer is None:
            if self._heading_path is not None:
                self._heading_path.append(heading.heading, heading.yaw, travel.distance, stamp_ns)
            return None
        return self._odometer.update(heading, travel, stamp_ns, interval, unsure=unsure)

    def _link(self, heading: HeadingStep, travel: Travel) -> tuple[AnyDirection, ...]:
        if self.links is None or not travel.known:
            return ()
        return self.links.add(travel.distance, heading.heading, heading.yaw)
