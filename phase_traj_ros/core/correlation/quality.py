# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Tests of a measured shift: whether it is a measurement, and whether the vehicle moves at all.

Without these tests, which the paper does not have, a covered lens, a scene cut and a stop look
like driving straight ahead. docs/measurements/quality.md shows how they were chosen.
"""

from collections import deque
from dataclasses import dataclass
from enum import Enum
import math

import numpy as np
from numpy.typing import ArrayLike
from phase_traj_ros.core.correlation.block_motion import BlockFlow, BlockMotion
from phase_traj_ros.core.correlation.phase_correlation import Frame, PhaseCorrelator, Shift
from phase_traj_ros.core.correlation.tuning import TUNING


@dataclass(frozen=True, slots=True, kw_only=True)
class GateSettings:
    """
    When a pair counts as a measurement, and not as two unrelated frames.

    Raises
    ------
    ValueError
        A value is out of its range.

    """

    min_significance: float = 6.0
    """Standard deviations by which the map has to stand out of noise around the shift."""
    look_past_zero: bool = True
    """Whether a peak at zero gives way to a second peak that most of the image follows."""

    def __post_init__(self) -> None:
        """Check the values."""
        if not (math.isfinite(self.min_significance) and self.min_significance >= 0):
            raise ValueError(
                f'min_significance is {self.min_significance}: give a finite number, 0 or more')

    def judge(
        self, shift: Shift, correlator: PhaseCorrelator, blocks: BlockMotion | None,
    ) -> Shift | None:
        """
        Return the shift to use for the pair, or None if nothing was measured.

        ``shift`` is what ``correlator`` has just measured. ``blocks`` holds the same two frames;
        None disables ``look_past_zero``.
        """
        significance = correlator.significance(shift)
        if (self.look_past_zero and blocks is not None
                and max(abs(shift.dx), abs(shift.dy)) <= TUNING.zero_px):
            second = correlator.second_peak(apart=TUNING.peak_distance_px)
            of_second = correlator.significance(second)
            if (self._suffices(of_second) and of_second > significance
                    and blocks.share_following(second) > 0.5):
                return second
        return shift if self._suffices(significance) else None

    def _suffices(self, significance: float) -> bool:
        return significance > 0 and significance >= self.min_significance


@dataclass(frozen=True, slots=True, kw_only=True)
class StillnessSettings:
    """
    When a vehicle counts as stationary.

    Raises
    ------
    ValueError
        A value is out of its range.

    """

    seconds: float = 0.5
    """Time over which the motion of the blocks is averaged."""
    max_motion: float = 2e-3
    """Largest mean speed of a stationary block, in widths of the frame per second."""

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ('seconds', 'max_motion'):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f'{name} is {value}: give a finite number above 0')


class StillnessDetector:
    """
    Separates a stationary vehicle from one that creeps.

    A moving vehicle, however slow, displaces every part of the image, away from the point it
    drives towards. With a stationary one, noise and shaking average out, and traffic covers only
    a part of the image.
    """

    def __init__(self, settings: StillnessSettings | None = None) -> None:
        """Make a detector that has seen no frame."""
        self._settings = settings or StillnessSettings()
        # The newest pairs, with their intervals.
        self._flows: deque[tuple[float, BlockFlow]] = deque()
        self._still = False

    def reset(self) -> None:
        """Forget the pairs seen so far: the next ones are unrelated to them."""
        self._flows.clear()
        self._still = False

    def update(self, flow: BlockFlow, interval: float, width: int) -> bool:
        """
        Take the flow of the next pair of frames, of this ``width`` in pixels.

        ``interval`` is the time between them in seconds. Return whether the vehicle is stationary:
        False until enough time is averaged.
        """
        flows = self._flows
        if flows and len(flows[-1][1].vectors) != len(flow.vectors):
            self.reset()
        # The flow of a pair shows no more than about a pixel, however long the pair is.
        interval = min(interval, self._settings.seconds)
        flows.append((interval, flow))
        lasted = sum(each for each, _ in flows)
        # The stamps jitter, so the window ends at the nearest frame.
        enough = self._settings.seconds - interval / 2
        while lasted - flows[0][0] > enough:
            lasted -= flows.popleft()[0]
        if lasted > enough:
            moving = self._moving_share(lasted, self._settings.max_motion * width)
            self._still = moving < (TUNING.moving_again_share if self._still else 0.5)
        return self._still

    def _moving_share(self, lasted: float, limit: float) -> float:
        """
        Return the share of the textured blocks that move faster than ``limit``, in px/s.

        The pairs of the window have ``lasted`` so long, in seconds.
        """
        pairs = [flow for _, flow in self._flows]
        textured = np.mean([flow.textured for flow in pairs], axis=0) >= 0.5
        mean = np.sum([flow.vectors for flow in pairs], axis=0)[textured] / lasted
        if not len(mean):
            return 1.0
        shake = np.median(mean, axis=0)
        if np.hypot(*shake) <= TUNING.max_shake * limit:
            mean = mean - shake
        return float(np.mean(np.hypot(mean[:, 0], mean[:, 1]) > limit))


class Quality(Enum):
    """Quality of a pair of frames."""

    MEASURED = 'measured'
    """The frames show how the view has moved."""
    STILL = 'still'
    """The vehicle is stationary."""
    NOTHING = 'nothing'
    """Nothing is measured: the two frames are unrelated, or one of them is constant."""


class PairQuality:
    """
    The enabled tests, for the frames of one camera.

    Call ``update`` for every frame that the correlator accepted, and ``judge`` after it if that
    gave a shift.
    """

    def __init__(
        self, *, gate: GateSettings | None = None, stillness: StillnessSettings | None = None,
        mask: ArrayLike | None = None,
    ) -> None:
        """Make the tests; None disables one. ``mask`` is that of the correlator."""
        self._gate = gate
        self._detector = None if stillness is None else StillnessDetector(stillness)
        self._blocks = BlockMotion(mask=mask)
        self.needs_frames = stillness is not None or (gate is not None and gate.look_past_zero)
        """Whether any of the tests needs the frames, and not only the map."""
        self._has_pair = False
        self._width = 0

    def exclude(self, weights: ArrayLike | None) -> None:
        """Ignore areas in addition to the mask, from (H, W) weights; None for none."""
        self._blocks.exclude(weights)

    def interrupt(self) -> None:
        """
        Keep the newest frame, and forget the earlier pairs.

        A gap, a change of encoding or a jump of time separates them from the next pair.
        """
        if self._detector is not None:
            self._detector.reset()

    def update(self, frame: Frame) -> None:
        """Take the next frame, the same one as the correlator."""
        if self.needs_frames:
            self._has_pair = self._blocks.update(frame)
            self._width = frame.shape[1]

    def judge(
        self, shift: Shift, correlator: PhaseCorrelator, interval: float,
    ) -> tuple[Quality, Shift]:
        """
        Return the quality of the pair, and the shift to use for it.

        ``interval`` is the time between its frames in seconds. A pair that is not a measurement is
        not evidence for or against standing still.
        """
        if self._gate is not None:
            blocks = self._blocks if self._has_pair else None
            accepted = self._gate.judge(shift, correlator, blocks)
            if accepted is None:
                return Quality.NOTHING, shift
            shift = accepted
        elif shift.response == 0.0:
            return Quality.NOTHING, shift
        if self._detector is not None and self._has_pair and self._detector.update(
                self._blocks.flow(), interval, self._width):
            return Quality.STILL, shift
        return Quality.MEASURED, shift
