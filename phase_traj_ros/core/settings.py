# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The settings of the method."""

from dataclasses import dataclass, field
from enum import Enum
import math

from phase_traj_ros.core.camera.lens import check_tilt, Lens
from phase_traj_ros.core.codes.from_shift import DynamicChainCode, PAPER_THRESHOLD
from phase_traj_ros.core.codes.links import MIN_STEP
from phase_traj_ros.core.codes.sectors import HeadingSector
from phase_traj_ros.core.correlation.quality import GateSettings, StillnessSettings
from phase_traj_ros.core.correlation.view import View
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
    'code_step': 'the length of the links',
    'lens': 'the lens (see use_lens)',
    'max_speeds': 'the number of speeds to keep',
    'measures_road': 'whether the distance is measured on the road'}
# A threshold that is set or removed changes these together, and everything starts again.
_SWITCHED = ('code_source', 'draws_heading', 'measures_heading', 'measures_road')


class PathSource(Enum):
    """Source of the path."""

    AUTO = 'auto'
    """The heading if the codes come from the turns, else the codes."""
    CODES = 'codes'
    """A unit step along the direction for each direction code, as in the paper."""
    HEADING = 'heading'
    """A step along the measured heading for each measured pair."""


class CodeSource(Enum):
    """Source of the codes."""

    AUTO = 'auto'
    """The turns of the heading; an unknown camera is learned from the drive."""
    SHIFT = 'shift'
    """The shift compared with the threshold, as in the paper."""
    HEADING = 'heading'
    """The quantised heading."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimatorSettings:
    """Settings of the method; the defaults are those of the paper."""

    threshold: float = PAPER_THRESHOLD
    """T in pixels per frame."""
    view: View = field(default_factory=View)
    """Reduction of the frames, and orientation of the camera."""
    max_gap: float = 0.0
    """Longest interval between two frames that are compared, in seconds; 0 for no limit."""
    nominal_period: float = 0.0
    """Frame interval for which the threshold is meant, in seconds; 0 for any, as in the paper."""
    confirm_frames: int = 1
    """Number of consecutive pairs beyond the threshold that start a turn; 1 in the paper."""
    release_frames: int = 1
    """Number of consecutive pairs that end a turn; 1 in the paper."""
    lens: Lens | None = None
    """Lens of the camera; with it, heading and turns are measured."""
    code_source: CodeSource = CodeSource.SHIFT
    """Source of the codes; HEADING requires a lens."""
    connectivity: int = 4
    """Number of directions to which the heading is quantised: 4, or 8 for Freeman's codes."""
    path_from: PathSource = PathSource.AUTO
    """Source of the path."""
    speed: float = 0.0
    """
    Constant speed of the vehicle in metres per second; 0 if unknown.

    It, the next two and a path from the heading require a lens, unless ``code_source`` is AUTO.
    """
    awaits_speeds: bool = False
    """Whether ``TrajectoryEstimator.add_speed`` provides speeds."""
    camera_height: float = 0.0
    """Height of the camera above the road in metres; 0 if unknown."""
    camera_height_deviation: float = 0.04
    """Standard deviation of the height, as a fraction of it."""
    camera_pitch_deg: float = 0.0
    """Pitch of the camera relative to the road, positive down; 0: estimated from the drive."""
    code_step: float = 0.0
    """Length of a link of the chain code of equal links, in ``length_unit``; 0: no links."""
    gate: GateSettings | None = None
    """Conditions for a measured pair; None accepts all pairs, as in the paper."""
    stillness: StillnessSettings | None = None
    """Conditions for a standing vehicle; None disables the detection, as in the paper."""
    max_speeds: int | None = None
    """Number of speeds to keep; None keeps all."""
    max_runs: int | None = None
    """Number of runs of codes to keep, per series; None keeps all."""
    max_corners: int | None = None
    """Number of corners of the path to keep; None keeps all."""

    def __post_init__(self) -> None:
        """Check the values that no part of the estimator checks itself."""
        for name in ('max_gap', 'nominal_period', 'speed', 'camera_height',
                     'camera_height_deviation'):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise ValueError(f'{name} is {value}: give a finite number of 0 or more')
        for name in ('max_speeds', 'max_corners'):
            limit = getattr(self, name)
            if limit is not None and limit < 1:
                raise ValueError(f'{name} is {limit}: give at least 1, or None to keep all')
        check_tilt('camera_pitch_deg', self.camera_pitch_deg)
        if self.connectivity == 8 and self.code_source is not CodeSource.HEADING:
            raise ValueError('connectivity is 8: this requires code_source heading; the other code'
                             ' sources give right angles only')
        if self.code_step != 0 and not MIN_STEP <= self.code_step < math.inf:
            raise ValueError(
                f'code_step is {self.code_step}: give a finite number of {MIN_STEP} or more, or'
                ' 0 for no links')
        if self.speed > 0 and self.awaits_speeds:
            raise ValueError('speed and awaits_speeds are both set: give one of them')
        # They report invalid values in their own words.
        HeadingSector(self.connectivity)
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
    def by_heading(self) -> bool:
        """Return whether the codes come from the turns or the heading, not from the shift."""
        return self.code_source is not CodeSource.SHIFT

    @property
    def guards(self) -> bool:
        """Return whether cuts, fixed areas and contradictions are acted on."""
        return self.code_source is CodeSource.AUTO

    @property
    def threshold_set(self) -> float | None:
        """Return the threshold; None if the codes come from the turns or the heading."""
        return None if self.by_heading else self.threshold

    @property
    def needs_lens(self) -> bool:
        """Return whether a setting requires a lens."""
        return self.by_heading or self.measures_distance

    @property
    def learns_lens(self) -> bool:
        """Return whether the camera is learned from the drive."""
        return self.lens is None and self.code_source is CodeSource.AUTO

    @property
    def drawn_from(self) -> PathSource:
        """Return the source of the path, CODES or HEADING."""
        if self.path_from is not PathSource.AUTO:
            return self.path_from
        return PathSource.HEADING if self.code_source is CodeSource.AUTO else PathSource.CODES

    @property
    def draws_heading(self) -> bool:
        """Return whether the path is drawn from the heading."""
        return self.drawn_from is PathSource.HEADING

    @property
    def awaits_lens(self) -> bool:
        """
        Return whether a lens is required that the settings neither give nor have learned.

        ``TrajectoryEstimator.use_lens`` has to set it before the first frame.
        """
        return self.needs_lens and self.lens is None and not self.learns_lens

    @property
    def measures_heading(self) -> bool:
        """Return whether heading and turns are measured."""
        return self.lens is not None or self.needs_lens

    @property
    def speed_given(self) -> bool:
        """Return whether the speed of the vehicle is given."""
        return self.speed > 0 or self.awaits_speeds

    @property
    def metric(self) -> bool:
        """Return whether a speed or the camera height gives odometry in metres."""
        return self.speed_given or self.camera_height > 0

    @property
    def measures_distance(self) -> bool:
        """Return whether the distance of each pair is measured or given."""
        return self.draws_heading or self.metric or self.code_step > 0

    @property
    def measures_road(self) -> bool:
        """Return whether the distance is measured on the road: a constant speed replaces it."""
        return self.measures_distance and self.speed == 0.0

    @property
    def length_unit(self) -> LengthUnit:
        """Return the unit of distances."""
        return LengthUnit.METRE if self.metric else LengthUnit.CAMERA_HEIGHT

    def path_unit(self, *, measured: bool) -> LengthUnit:
        """Return the unit of the drawn path: steps if no distance was ``measured``."""
        told = self.metric or measured
        return self.length_unit if self.draws_heading and told else LengthUnit.STEP
