# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the vehicle has been: the drawn path, and in metres where a speed is known."""

from phase_traj_ros.core.codes.chain import Step
from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.path.heading_path import HeadingPath
from phase_traj_ros.core.path.odometry import Odometer, Odometry
from phase_traj_ros.core.path.trajectory import ChainPath, DrawnPath
from phase_traj_ros.core.road.travel import Travel, TravelState
from phase_traj_ros.core.settings import EstimatorSettings


class Route:
    """Goes on with each pair of frames, along the direction or along the heading."""

    def __init__(self, settings: EstimatorSettings) -> None:
        """Make a route that has not started; what it is made from stays as it is now."""
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
        self._drawn: DrawnPath = self._chain_path
        if from_heading and self._heading_path is not None:
            self._drawn = self._heading_path

    @property
    def drawn(self) -> DrawnPath:
        """Return the path that is drawn."""
        return self._drawn

    def reset(self) -> None:
        """Go back to the origin."""
        for part in (self._chain_path, self._heading_path, self._odometer):
            if part is not None:
                part.reset()

    def start(self, stamp_ns: int) -> None:
        """Start at the origin, on a route that has not started."""
        self._chain_path.start(stamp_ns)
        if self._heading_path is not None:
            self._heading_path.start(stamp_ns)

    def add(
        self, step: Step, heading: HeadingStep | None, travel: Travel | None, stamp_ns: int,
        interval_ns: int,
    ) -> Odometry | None:
        """
        Take what a pair of frames adds.

        Parameters
        ----------
        step
            The codes of the pair.
        heading
            What it adds to the heading, where that is measured.
        travel
            What it adds to the way, where that is.
        stamp_ns
            Of its second frame.
        interval_ns
            Since its first one.

        """
        if step.appended:
            self._chain_path.append(step.direction, stamp_ns)
        if heading is None or travel is None or self._heading_path is None:
            return None
        if self._odometer is None:
            self._heading_path.append(heading.heading, heading.yaw, travel.distance, stamp_ns)
            return None
        interval = interval_ns * 1e-9
        if travel.state is TravelState.UNKNOWN:
            self._odometer.miss(heading, travel, interval)
            return None
        return self._odometer.update(heading, travel, stamp_ns, interval)
