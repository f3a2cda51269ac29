# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a measured shift is worth: whether there is one, and whether anything moves at all.

Without these tests a covered lens, a scene cut and a vehicle at a red light all look like
driving straight on. The paper has none of them. docs/quality.md shows how they were chosen.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np
from phase_traj_ros.core.block_motion import BlockFlow, BlockMotion
from phase_traj_ros.core.phase_correlation import PhaseCorrelator, Shift

# A peak no further than this from zero, in pixels along each axis, may be that of a fixed pattern.
_AT_ZERO = 0.75
# Half a side of the square about the peak in which no second one is looked for, in pixels.
_APART = 8
# Share of the blocks that has to move for a vehicle that stands to be taken to have driven off.
# A vehicle that passes in front of the camera hides many of them.
_DRIVEN_OFF = 0.65
# Mean displacement of the whole picture that is taken for shaking, as a multiple of still_motion.
_SHAKING = 3.0


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
    """Standard deviations by which the peak has to stand out of noise; see PhaseCorrelator."""
    look_past_zero: bool = True
    """Whether a peak at zero gives way to a second one that most of the picture follows."""

    def __post_init__(self) -> None:
        """Check the values."""
        if not 0.0 <= self.min_significance < float('inf'):
            raise ValueError(
                f'min_significance is {self.min_significance}: give a finite number, 0 or more')


class MeasurementGate:
    """Tells measured shifts from those of pairs that have nothing in common."""

    def __init__(self, settings: GateSettings | None = None) -> None:
        """Make a gate; it has no state of its own."""
        self._settings = settings or GateSettings()

    def judge(
        self, shift: Shift, correlator: PhaseCorrelator, blocks: BlockMotion,
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
            Holds the same two frames.

        """
        if self._is_measured(shift, correlator):
            return self._past_zero(shift, correlator, blocks) or shift
        return None

    def _is_measured(self, shift: Shift, correlator: PhaseCorrelator) -> bool:
        return correlator.significance(shift) >= self._settings.min_significance

    def _past_zero(
        self, shift: Shift, correlator: PhaseCorrelator, blocks: BlockMotion,
    ) -> Shift | None:
        if not self._settings.look_past_zero or max(abs(shift.dx), abs(shift.dy)) > _AT_ZERO:
            return None
        second = correlator.second_peak(apart=_APART)
        if self._is_measured(second, correlator) and blocks.share_following(second) > 0.5:
            return second
        return None


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
    """Their mean displacement per pair below which they stand, as a share of the width."""

    def __post_init__(self) -> None:
        """Check the values."""
        if self.frames < 1:
            raise ValueError(f'frames is {self.frames}: give at least 1')
        if not 0.0 < self.max_motion < float('inf'):
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
        Take the flow of the next pair of frames ``width`` pixels wide; return whether it stands.

        Never before as many pairs have come as are averaged.
        """
        self._flows.append(flow)
        if len(self._flows) == self._settings.frames:
            moving = self._moving_share(self._settings.max_motion * width)
            self._still = moving < (_DRIVEN_OFF if self._still else 0.5)
        return self._still

    def _moving_share(self, limit: float) -> float:
        """Return the share of the textured blocks whose mean displacement is above ``limit``."""
        mean = np.mean([flow.vectors for flow in self._flows], axis=0)
        textured = np.mean([flow.textured for flow in self._flows], axis=0) >= 0.5
        mean = mean[textured]
        if not len(mean):
            return 1.0
        shake = np.median(mean, axis=0)
        if np.hypot(*shake) <= _SHAKING * limit:
            mean = mean - shake
        return float(np.mean(np.hypot(mean[:, 0], mean[:, 1]) > limit))
