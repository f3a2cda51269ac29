# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What can be chosen about the method."""

from dataclasses import dataclass, field
from enum import Enum
import math

from phase_traj_ros.core.chain_code import PAPER_THRESHOLD
from phase_traj_ros.core.heading_estimator import Lens
from phase_traj_ros.core.quality import GateSettings, StillnessSettings
from phase_traj_ros.core.view import View
from phase_traj_ros.core.windows import Window


class CodeSource(Enum):
    """What the codes are made from."""

    SHIFT = 'shift'
    """The shift against the threshold, as the paper has it."""
    HEADING = 'heading'
    """The heading, quantised to right angles."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimatorSettings:
    """What can be chosen about the method; the defaults are the paper's."""

    threshold: float = PAPER_THRESHOLD
    """T in pixels per frame."""
    window: Window = Window.SQRT_HANN
    """Taper of the frames."""
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
    code_source: CodeSource = CodeSource.SHIFT
    """What the codes are made from; the heading takes a lens."""
    gate: GateSettings | None = None
    """When a pair counts as measured; None: always (the paper)."""
    stillness: StillnessSettings | None = None
    """When the vehicle counts as standing still; None: never (the paper)."""
    max_runs: int | None = None
    """Runs of codes kept, per series; None keeps all."""
    max_corners: int | None = None
    """Corner points of the path kept; None keeps all."""

    def __post_init__(self) -> None:
        """Check what no part of the estimator checks by itself."""
        for name, value in (('max_gap', self.max_gap), ('nominal_period', self.nominal_period)):
            if not (math.isfinite(value) and value >= 0):
                raise ValueError(f'{name} is {value}: give a finite number of seconds, or 0')
        if self.code_source is CodeSource.HEADING and self.lens is None:
            raise ValueError('codes from the heading need focal_px or hfov_deg: give one of them')
