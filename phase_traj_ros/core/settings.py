# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What can be chosen about the method."""

from dataclasses import dataclass, field
from enum import Enum
import math

from phase_traj_ros.core.camera.lens import Lens, MOST_TILT_DEG
from phase_traj_ros.core.codes.from_shift import DynamicChainCode, PAPER_THRESHOLD
from phase_traj_ros.core.codes.links import LEAST_STEP
from phase_traj_ros.core.codes.sectors import CONNECTIVITIES
from phase_traj_ros.core.correlation.quality import GateSettings, StillnessSettings
from phase_traj_ros.core.correlation.transforms import TransformLibrary
from phase_traj_ros.core.correlation.view import View
from phase_traj_ros.core.correlation.windows import Window
from phase_traj_ros.core.path.way import LengthUnit


# Parts of the estimator are built from these at the start.
_FIXED = {
    'code_source': 'the code source', 'connectivity': 'the connectivity',
    'draws_heading': 'the source of the path',
    'measures_heading': 'whether the heading is measured',
    'metric': 'whether a speed or the height of the camera is known',
    'camera_height': 'the height of the camera',
    'camera_height_deviation': 'the deviation of that height',
    'camera_pitch_deg': 'the pitch of the camera',
    'code_step': 'the length of the links'}
# A threshold that is set or removed changes these together, and everything starts again.
_SWITCHED = ('code_source', 'draws_heading', 'measures_heading')


class PathSource(Enum):
    """What the path is drawn from."""

    AUTO = 'auto'
    """The heading where the codes come from the turns, else the codes."""
    CODES = 'codes'
    """A unit step along the direction for each direction code, as the paper has it."""
    HEADING = 'heading'
    """A step along the measured heading for each measured pair."""


class CodeSource(Enum):
    """What the codes are made from."""

    AUTO = 'auto'
    """The turns; the camera is learned from the drive where it is not known."""
    SHIFT = 'shift'
    """The shift against the threshold, as the paper has it."""
    HEADING = 'heading'
    """The heading, quantised."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimatorSettings:
    """What can be chosen about the method; the defaults are the paper's."""

    threshold: float = PAPER_THRESHOLD
    """T in pixels per frame."""
    threshold_deg_s: float = 0.0
    """T as a yaw rate in degrees per second, instead of the above; 0: none. Takes a lens."""
    window: Window = Window.SQRT_HANN
    """Taper of the frames."""
    transform: TransformLibrary = TransformLibrary.AUTO
    """Which library computes the Fourier transforms."""
    view: View = field(default_factory=View)
    """Which part of the frames is correlated, and at which scale."""
    max_gap: float = 0.0
    """Longest time between two frames that are compared, in seconds; 0 for any."""
    nominal_period: float = 0.0
    """Time between two frames that the threshold is meant for, in seconds; 0 for any (paper)."""
    confirm_frames: int = 1
    """Pairs in a row beyond the threshold that make a turn; 1 is the paper's."""
    release_frames: int = 1
    """Pairs in a row that end a turn; 1 is the paper's."""
    lens: Lens | None = None
    """What is known of the camera; with it, heading and turns are measured."""
    estimate_fov: bool = False
    """Whether the camera is learned from the drive, where no lens is given; AUTO always does."""
    code_source: CodeSource = CodeSource.SHIFT
    """What the codes are made from; the heading takes a lens."""
    connectivity: int = 4
    """Directions that the heading is quantised to: 4, or 8 for Freeman's codes."""
    path_from: PathSource = PathSource.AUTO
    """What the path is drawn from; the heading takes a lens."""
    speed: float = 0.0
    """Of the vehicle, in metres per second, where it is constant; 0: not known. Takes a lens."""
    awaits_speeds: bool = False
    """Whether speeds come as it drives (``TrajectoryEstimator.add_speed``). Takes a lens."""
    camera_height: float = 0.0
    """Of the camera above the road, in metres; 0: not known. Takes a lens."""
    camera_height_deviation: float = 0.04
    """Standard deviation of the height, as a share of it."""
    camera_pitch_deg: float = 0.0
    """How far the camera looks down against the road; 0: found from the drive."""
    code_step: float = 0.0
    """Length of a link of the chain code of equal links, in ``length_unit``; 0: none."""
    gate: GateSettings | None = None
    """When a pair counts as measured; None: always (the paper)."""
    stillness: StillnessSettings | None = None
    """When the vehicle counts as standing still; None: never (the paper)."""
    max_speeds: int | None = None
    """Speeds kept; None keeps all."""
    max_runs: int | None = None
    """Runs of codes kept, per series; None keeps all."""
    max_corners: int | None = None
    """Corner points of the path kept; None keeps all."""

    def __post_init__(self) -> None:
        """Check what no part of the estimator checks by itself."""
        for name in ('max_gap', 'nominal_period', 'threshold_deg_s', 'speed', 'camera_height',
                     'camera_height_deviation'):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise ValueError(f'{name} is {value}: give a finite number of 0 or more')
        if not abs(self.camera_pitch_deg) <= MOST_TILT_DEG:
            raise ValueError(
                f'camera_pitch_deg is {self.camera_pitch_deg}: give degrees from'
                f' -{MOST_TILT_DEG:g} to {MOST_TILT_DEG:g}')
        if self.connectivity not in CONNECTIVITIES:
            raise ValueError(f'connectivity is {self.connectivity}: give 4 or 8')
        if self.connectivity == 8 and self.code_source is not CodeSource.HEADING:
            raise ValueError('shift and turns tell right angles only: a connectivity of 8 needs'
                             ' the code source heading')
        if self.code_step != 0 and not LEAST_STEP <= self.code_step < math.inf:
            raise ValueError(
                f'code_step is {self.code_step}: give a finite number of {LEAST_STEP} or more, or'
                ' 0 for no links')
        if self.speed > 0 and self.awaits_speeds:
            raise ValueError('the speed is either constant or comes as it drives: give one')
        # Says what it refuses; the codes are made of these numbers.
        DynamicChainCode(
            self.threshold, confirm_frames=self.confirm_frames,
            release_frames=self.release_frames, max_runs=self.max_runs)

    def check_change(self, after: 'EstimatorSettings', *, switches_rule: bool) -> None:
        """
        Check that an estimator with these settings can continue with others.

        ``switches_rule`` allows a change from the turns to the paper's rule, and back.

        Raises
        ------
        ValueError
            A setting that is fixed at the start differs.

        """
        for name, words in _FIXED.items():
            if getattr(after, name) != getattr(self, name) and not (
                    switches_rule and name in _SWITCHED):
                raise ValueError(
                    f'{words} is fixed at the start, and this would change it: start again with'
                    ' these settings')

    @property
    def threshold_set(self) -> float | None:
        """Return the threshold; None where the codes come from the turns, which need none."""
        return None if self.code_source is CodeSource.AUTO else self.threshold

    @property
    def needs_lens(self) -> bool:
        """Return whether anything that is asked for takes a lens."""
        return (
            self.code_source is not CodeSource.SHIFT or self.draws_heading
            or self.threshold_deg_s > 0 or self.metric or self.code_step > 0)

    @property
    def learns_lens(self) -> bool:
        """Return whether the camera is learned from the drive."""
        return self.lens is None and (
            self.estimate_fov or self.code_source is CodeSource.AUTO)

    @property
    def drawn_from(self) -> PathSource:
        """Return what the path is drawn from, CODES or HEADING."""
        if self.path_from is not PathSource.AUTO:
            return self.path_from
        return PathSource.HEADING if self.code_source is CodeSource.AUTO else PathSource.CODES

    @property
    def draws_heading(self) -> bool:
        """Return whether the path is drawn from the heading, and not from the codes."""
        return self.drawn_from is PathSource.HEADING

    @property
    def awaits_lens(self) -> bool:
        """
        Return whether a lens is needed that the settings neither give nor have estimated.

        It has to come by ``TrajectoryEstimator.use_lens``; no frame counts before.
        """
        return self.needs_lens and self.lens is None and not self.learns_lens

    @property
    def measures_heading(self) -> bool:
        """Return whether heading and turns are measured."""
        return self.lens is not None or self.estimate_fov or self.needs_lens

    @property
    def metric(self) -> bool:
        """Return whether a speed or the camera's height gives odometry in metres."""
        return self.speed > 0 or self.awaits_speeds or self.camera_height > 0

    @property
    def measures_distance(self) -> bool:
        """Return whether a step along the heading has the length of the way."""
        return self.measures_heading and (
            self.draws_heading or self.metric or self.code_step > 0)

    @property
    def length_unit(self) -> LengthUnit:
        """Return what distances are in."""
        return LengthUnit.METRE if self.metric else LengthUnit.CAMERA_HEIGHT
