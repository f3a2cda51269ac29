# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The result of a pair of frames, and the counters of the estimator."""

from dataclasses import dataclass, replace

from phase_traj_ros.core.camera.in_use import CameraInUse
from phase_traj_ros.core.codes.chain import Step
from phase_traj_ros.core.codes.freeman import AnyDirection
from phase_traj_ros.core.correlation.phase_correlation import Shift
from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.core.heading.turns import Turn
from phase_traj_ros.core.path.odometry import Odometry
from phase_traj_ros.core.path.trajectory import Corner
from phase_traj_ros.core.road.travel import Travel
from phase_traj_ros.core.status import PairStatus


@dataclass(frozen=True, slots=True)
class Update:
    """Result of one pair of frames."""

    pair: int
    """Number of the pair, 0 for the first since the start or the last reset."""
    stamp_ns: int
    """Stamp of the second frame of the pair, in nanoseconds."""
    interval_ns: int
    """
    Time since its first frame, in nanoseconds.

    The first frame is the newest one before that is not a repeated picture.
    """
    shift: Shift | None
    """The measured shift; None if the two frames cannot be compared."""
    step: Step
    status: PairStatus
    tip: Corner
    """Current pose of the drawn trajectory."""
    heading: HeadingStep | None = None
    """Yaw, yaw rate and heading; None if the heading is not measured."""
    turns: tuple[Turn, ...] = ()
    """Turns whose end was detected with this pair."""
    camera: CameraInUse | None = None
    """Camera in use from now on, if it changed with this pair."""
    cut: bool = False
    """Whether a new scene starts at the first frame of the pair, after a cut in the video."""
    odometry: Odometry | None = None
    """Pose and motion in metres; None without a height or a speed, which give metres."""
    travel: Travel | None = None
    """Distance of the pair; None if no distance is measured."""
    links: tuple[AnyDirection, ...] = ()
    """Directions of the equal links that end with this pair."""
    speed: float | None = None
    """Mean speed since the frame with which it was compared, per second; None if unknown."""
    speed_variance: float | None = None
    """Its variance; None if the speed is unknown."""

    def after(self, before: 'Update | None') -> 'Update':
        """
        Return this update relative to that of a foreseen frame before it; itself if None.

        Both are relative to the newest measured frame before them.
        """
        if before is None:
            return self
        interval_ns = self.interval_ns - before.interval_ns
        share = interval_ns / self.interval_ns
        shift, heading, travel = self.shift, self.heading, self.travel
        if shift is not None and before.shift is not None:
            shift = replace(shift, dx=shift.dx - before.shift.dx, dy=shift.dy - before.shift.dy)
        if heading is not None and before.heading is not None:
            heading = heading.part(heading.yaw - before.heading.yaw, share)
        if travel is not None and before.travel is not None:
            travel = travel.part(travel.distance - before.travel.distance, share)
        return replace(self, interval_ns=interval_ns, shift=shift, heading=heading, travel=travel)


@dataclass(slots=True)
class Counters:
    """Counts since the estimator was made; a reset does not clear them."""

    frames: int = 0
    """Frames processed, without those of a repeated stamp."""
    repeated: int = 0
    """Frames with the stamp or the picture of the previous one."""
    dropped: int = 0
    """Frames dropped because their stamp is late, or far from those around it."""
    skipped: int = 0
    """Frames that could not be read, decoded or used."""
    gaps: int = 0
    """Pairs whose interval is longer than ``max_gap``."""
    reprimed: int = 0
    """Frames after a change of the size, the encoding or the settings."""
    unmeasured: int = 0
    """Pairs that could not be measured."""
    still: int = 0
    """Pairs in which the vehicle did not move."""
    time_resets: int = 0
    """Restarts because the stamps jumped, and went on from there."""

    def count(self, status: PairStatus) -> None:
        """Count a pair by its status, before it is coded."""
        if name := _COUNTED.get(status):
            setattr(self, name, getattr(self, name) + 1)


_COUNTED = {
    PairStatus.GAP: 'gaps', PairStatus.REPRIMED: 'reprimed', PairStatus.STILL: 'still',
    PairStatus.NO_MEASUREMENT: 'unmeasured', PairStatus.REPEATED: 'repeated'}
