# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a pair of frames adds, and what is counted."""

from dataclasses import asdict, dataclass, replace

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
    """What one pair of frames adds."""

    pair: int
    """Number of the pair, 0 for the first since the start or the last reset."""
    stamp_ns: int
    """Stamp of the pair's second frame."""
    interval_ns: int
    """Time since its first frame."""
    shift: Shift | None
    """The measured shift, None where the two frames cannot be compared."""
    step: Step
    status: PairStatus
    tip: Corner
    """Where the drawn trajectory has got to."""
    heading: HeadingStep | None = None
    """Yaw, yaw rate and heading, where a lens is given."""
    turns: tuple[Turn, ...] = ()
    """Turns that are now known to have ended, where a lens is given."""
    camera: CameraInUse | None = None
    """What the camera is taken for from now on, where that is new with this pair."""
    cut: bool = False
    """Whether a new scene begins with the pair's first frame, as the film was cut before it."""
    odometry: Odometry | None = None
    """Pose and motion in metres, where a speed or the camera's height is known, too."""
    travel: Travel | None = None
    """How far the vehicle has gone, where the path has the length of the way."""
    links: tuple[AnyDirection, ...] = ()
    """Directions of the links that end with this pair, where there are links."""

    @property
    def speed(self) -> float | None:
        """Return the pair's mean speed, in the unit of ``travel`` per second; None if unknown."""
        if self.travel is None or not self.travel.known:
            return None
        return self.travel.distance / (self.interval_ns * 1e-9)

    @property
    def speed_variance(self) -> float | None:
        """Return the variance of the speed; None if it is not known."""
        if self.travel is None or not self.travel.known:
            return None
        return self.travel.variance / (self.interval_ns * 1e-9) ** 2


@dataclass(slots=True)
class Counters:
    """What has happened since the estimator was made; a reset does not clear it."""

    frames: int = 0
    """Frames taken, repeated ones not included."""
    repeated: int = 0
    """Frames dropped because their stamp was that of the frame before."""
    gaps: int = 0
    """Pairs whose frames were too far apart in time."""
    reprimed: int = 0
    """Frames of another size or encoding than the one before, or after a change of settings."""
    unmeasured: int = 0
    """Pairs in which there was nothing to measure."""
    still: int = 0
    """Pairs in which the vehicle stood."""
    time_resets: int = 0
    """Resets because a stamp lay before the one before it."""

    def count(self, status: PairStatus) -> None:
        """Count a pair by its status, before it is coded."""
        if status is PairStatus.GAP:
            self.gaps += 1
        elif status is PairStatus.REPRIMED:
            self.reprimed += 1
        elif status is PairStatus.NO_MEASUREMENT:
            self.unmeasured += 1
        elif status is PairStatus.STILL:
            self.still += 1

    def copy(self) -> 'Counters':
        """Return the counts as they are now."""
        return replace(self)

    def as_dict(self) -> dict[str, int]:
        """Return the counts by name."""
        return asdict(self)
