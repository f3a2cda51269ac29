# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a measured shift is worth: whether there is one, and whether anything moves at all.

Without these tests a covered lens, a scene cut and a vehicle at a red light all look like
driving straight on. The paper has none of them. docs/measurements/quality.md shows how they were
chosen.
"""

from collections import deque
from dataclasses import dataclass
from enum import Enum
import math

import numpy as np
from numpy.typing import ArrayLike
from phase_traj_ros.core.correlation.block_motion import BlockFlow, BlockMotion
from phase_traj_ros.core.correlation.phase_correlation import Frame, PhaseCorrelator, Shift

# A peak no further than this from zero, in pixels along each axis, may be that of a fixed pattern.
_AT_ZERO = 0.75
# Half a side of the square about the peak in which no second one is looked for, in pixels.
_APART = 8
# Share of the blocks that has to move for a vehicle that stands to be taken to have driven off.
# A vehicle that passes in front of the camera hides many of them.
_DRIVEN_OFF = 0.65
# Mean displacement of the whole picture that is taken for shaking, as a multiple of still_motion.
_SHAKING = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class GateSettings:
    """
    When a pair counts as measured.

    Raises
    ------
    ValueError
        A value is out of its range.

    """

    min_significance: float = 6.0
    """Standard deviations by which the map has to stand out of noise about the shift."""
    look_past_zero: bool = True
    """Whether a peak at zero gives way to a second one that most of the picture follows."""

    def __post_init__(self) -> None:
        """Check the values."""
        if not (math.isfinite(self.min_significance) and self.min_significance >= 0):
            raise ValueError(
                f'min_significance is {self.min_significance}: give a finite number, 0 or more')


class MeasurementGate:
    """Tells measured shifts from those of frames that have nothing in common."""

    def __init__(self, settings: GateSettings | None = None) -> None:
        """Make a gate; it remembers nothing from pair to pair."""
        self._settings = settings or GateSettings()

    def judge(
        self, shift: Shift, correlator: PhaseCorrelator, blocks: BlockMotion | None,
    ) -> Shift | None:
        """
        Return the shift that the pair is to be judged by, or None if nothing was measured.

        Parameters
        ----------
        shift
            What ``correlator`` has just measured.
        correlator
            Holds the map of this pair.
        blocks
            Holds the same two frames; looked at only if the shift is zero and the settings say
            so, and not looked past zero without it.

        """
        significance = correlator.significance(shift)
        if (self._settings.look_past_zero and blocks is not None
                and max(abs(shift.dx), abs(shift.dy)) <= _AT_ZERO):
            second = correlator.second_peak(apart=_APART)
            if self._hides(second, significance, correlator, blocks):
                return second
        return shift if self._suffices(significance) else None

    def _hides(
        self, second: Shift, first_significance: float, correlator: PhaseCorrelator,
        blocks: BlockMotion,
    ) -> bool:
        """Return whether a peak at zero is a fixed pattern's, and ``second`` is the scene's."""
        significance = correlator.significance(second)
        return (self._suffices(significance) and significance > first_significance
                and blocks.share_following(second) > 0.5)

    def _suffices(self, significance: float) -> bool:
        return significance > 0 and significance >= self._settings.min_significance


@dataclass(frozen=True, slots=True, kw_only=True)
class StillnessSettings:
    """
    When a vehicle counts as standing still.

    Raises
    ------
    ValueError
        A value is out of its range.

    """

    frames: int = 5
    """Pairs over which the motion of the picture's parts is averaged."""
    max_motion: float = 2e-4
    """Their mean displacement per pair up to which they stand, as a share of the width."""

    def __post_init__(self) -> None:
        """Check the values."""
        if self.frames < 1:
            raise ValueError(f'frames is {self.frames}: give at least 1')
        if not (math.isfinite(self.max_motion) and self.max_motion > 0):
            raise ValueError(f'max_motion is {self.max_motion}: give a finite number above 0')


class StillnessDetector:
    """
    Tells a vehicle that stands from one that creeps.

    A vehicle that drives, however slowly, moves every part of the picture, away from the point it
    drives to. One that stands moves none for long: noise and shaking average out, and what passes
    by covers a part of the picture only.
    """

    def __init__(self, settings: StillnessSettings | None = None) -> None:
        """Make a detector that has seen nothing."""
        self._settings = settings or StillnessSettings()
        self._flows: deque[BlockFlow] = deque(maxlen=self._settings.frames)
        self._still = False

    def reset(self) -> None:
        """Forget what was seen: the next pairs have nothing to do with it."""
        self._flows.clear()
        self._still = False

    def update(self, flow: BlockFlow, width: int) -> bool:
        """
        Take the flow of the next pair of frames, ``width`` pixels wide; return whether it stands.

        It never does before as many pairs have come as are averaged.
        """
        if self._flows and len(self._flows[-1].vectors) != len(flow.vectors):
            self.reset()
        self._flows.append(flow)
        if len(self._flows) == self._settings.frames:
            moving = self._moving_share(self._settings.max_motion * width)
            self._still = moving < (_DRIVEN_OFF if self._still else 0.5)
        return self._still

    def _moving_share(self, limit: float) -> float:
        """Return the share of the textured blocks whose mean displacement is above ``limit``."""
        textured = np.mean([flow.textured for flow in self._flows], axis=0) >= 0.5
        mean = np.mean([flow.vectors for flow in self._flows], axis=0)[textured]
        if not len(mean):
            return 1.0
        shake = np.median(mean, axis=0)
        if np.hypot(*shake) <= _SHAKING * limit:
            mean = mean - shake
        return float(np.mean(np.hypot(mean[:, 0], mean[:, 1]) > limit))


class Worth(Enum):
    """What a pair of frames tells."""

    MEASURED = 'measured'
    """How the view has moved."""
    STILL = 'still'
    """That the vehicle stands still."""
    NOTHING = 'nothing'
    """Nothing: the two frames have nothing in common, or one of them is constant."""


class PairQuality:
    """
    The tests that are switched on, for the frames of one camera.

    ``update`` takes every frame that the correlator took, and ``judge`` follows wherever that
    gave a shift.
    """

    def __init__(
        self, *, gate: GateSettings | None = None, stillness: StillnessSettings | None = None,
        mask: ArrayLike | None = None,
    ) -> None:
        """Make the tests; None switches one off. The mask is that of the correlator."""
        self._gate = None if gate is None else MeasurementGate(gate)
        self._detector = None if stillness is None else StillnessDetector(stillness)
        self._blocks = BlockMotion(mask=mask)
        self._needs_blocks = stillness is not None or (gate is not None and gate.look_past_zero)
        self._has_pair = False
        self._width = 0

    @property
    def looks_at_frames(self) -> bool:
        """Return whether any of the tests looks at the frames, and not at the map alone."""
        return self._needs_blocks

    def reset(self) -> None:
        """Forget all frames, as at the start and where the frames change."""
        self._blocks.reset()
        self._has_pair = False
        self.interrupt()

    def interrupt(self) -> None:
        """
        Keep the newest frame, and forget what was seen before it.

        The next pair has the newest frame as its first one, but a gap, a change of encoding or a
        jump of time lies between it and the pairs before.
        """
        if self._detector is not None:
            self._detector.reset()

    def update(self, frame: Frame) -> None:
        """Take the next frame, the very one that the correlator has taken."""
        if self._needs_blocks:
            self._has_pair = self._blocks.update(frame)
            self._width = frame.shape[1]

    def judge(self, shift: Shift, correlator: PhaseCorrelator) -> tuple[Worth, Shift]:
        """
        Return what the pair is worth, and the shift that it is to be judged by.

        A pair that is not measured says nothing of standing still, and is not held against it.
        """
        if self._gate is not None:
            blocks = self._blocks if self._has_pair else None
            believed = self._gate.judge(shift, correlator, blocks)
            if believed is None:
                return Worth.NOTHING, shift
            shift = believed
        elif shift.response == 0.0:
            return Worth.NOTHING, shift
        if self._detector is not None and self._has_pair and self._detector.update(
                self._blocks.flow(), self._width):
            return Worth.STILL, shift
        return Worth.MEASURED, shift
