# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole chain for one camera: a frame and its stamp in, what the pair adds out."""

from dataclasses import dataclass
from enum import Enum

from phase_traj_ros.core.chain_code import DynamicChainCode, PAPER_THRESHOLD, Step
from phase_traj_ros.core.phase_correlation import Frame, PhaseCorrelator, Shift
from phase_traj_ros.core.trajectory import ChainPath, Corner
from phase_traj_ros.core.windows import Window


class PairStatus(Enum):
    """How a pair of frames came to its movement code."""

    OK = 'ok'
    """Measured and judged: forward, or the pair on which a turn begins."""
    TURNING = 'turning'
    """Measured; the turn that began earlier goes on."""
    NO_MEASUREMENT = 'no_measurement'
    """One of the two frames is constant: there is nothing to correlate."""
    REPRIMED = 'reprimed'
    """The frame's size or type changed: it cannot be compared with the one before."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimatorSettings:
    """What can be chosen about the method; the defaults are the paper's."""

    threshold: float = PAPER_THRESHOLD
    """T in pixels per frame."""
    window: Window = Window.SQRT_HANN
    """Taper of the frames."""
    max_runs: int | None = None
    """Runs of codes kept, per series; None keeps all."""
    max_corners: int | None = None
    """Corner points of the path kept; None keeps all."""


@dataclass(frozen=True, slots=True)
class Update:
    """What one pair of frames adds."""

    pair: int
    """Number of the pair, 0 for the first since the start or the last reset."""
    stamp_ns: int
    """Stamp of the pair's second frame."""
    shift: Shift | None
    """The measured shift, None where the two frames cannot be compared."""
    step: Step
    status: PairStatus
    tip: Corner
    """Where the drawn trajectory has got to."""


@dataclass(slots=True)
class Counters:
    """What has happened since the estimator was made; a reset does not clear it."""

    frames: int = 0
    """Frames taken, repeated ones not included."""
    repeated: int = 0
    """Frames dropped because their stamp was that of the frame before."""
    reprimed: int = 0
    """Frames of another size or type than the one before."""
    unmeasured: int = 0
    """Pairs in which there was nothing to correlate."""
    time_resets: int = 0
    """Resets because a stamp lay before the one before it."""


class TrajectoryEstimator:
    """
    Follows one camera: correlates each frame with the one before, codes the shift, draws the path.

    The live node and the offline replay both drive this class, so their codes are the same.
    """

    def __init__(self, settings: EstimatorSettings | None = None) -> None:
        """
        Make an estimator that waits for its first frame.

        Raises
        ------
        ValueError
            A setting is out of its range.

        """
        self._settings = settings or EstimatorSettings()
        self._correlator = PhaseCorrelator(window=self._settings.window)
        self._codes = DynamicChainCode(
            self._settings.threshold, max_runs=self._settings.max_runs)
        self._path = ChainPath(max_corners=self._settings.max_corners)
        self.counters = Counters()
        self._frames = 0
        self._last_stamp_ns: int | None = None

    @property
    def settings(self) -> EstimatorSettings:
        """Return the settings in force."""
        return self._settings

    @property
    def codes(self) -> DynamicChainCode:
        """Both chain codes so far."""
        return self._codes

    @property
    def path(self) -> ChainPath:
        """Return the drawn trajectory so far."""
        return self._path

    @property
    def frames(self) -> int:
        """Frames taken since the start or the last reset: one more than movement codes."""
        return self._frames

    @property
    def last_stamp_ns(self) -> int | None:
        """Stamp of the newest frame taken, None before the first."""
        return self._last_stamp_ns

    def set_threshold(self, threshold: float) -> None:
        """
        Judge by another threshold from the next pair on; everything else stays.

        Raises
        ------
        ValueError
            The threshold is not a finite positive number; nothing has changed.

        """
        self._codes.threshold = threshold

    def reset(self) -> None:
        """Start anew with the next frame: no codes, no path, direction forward."""
        self._correlator.reset()
        self._forget()

    def update(self, frame: Frame, stamp_ns: int) -> Update | None:
        """
        Take the next frame; return what its pair adds.

        None is returned for the first frame and for a frame with the stamp of the one before,
        which is no frame at all. A stamp before that (a bag that is played in a loop) resets
        everything, and the frame is the first of the new start.

        Parameters
        ----------
        frame
            (H, W) uint8, uint16 or float32.
        stamp_ns
            When it was taken, in nanoseconds.

        Raises
        ------
        FrameError
            The frame cannot be used. It is as if it had never come.

        """
        if stamp_ns == self._last_stamp_ns:
            self.counters.repeated += 1
            return None
        # First of all the frame has to be usable: one that is not must not reset anything.
        shift = self._correlator.update(frame)
        if self._last_stamp_ns is not None and stamp_ns < self._last_stamp_ns:
            self.counters.time_resets += 1
            self._forget()
        self._last_stamp_ns = stamp_ns
        self._frames += 1
        self.counters.frames += 1
        self._path.start(stamp_ns)
        return self._pair(shift, stamp_ns) if self._frames > 1 else None

    def _forget(self) -> None:
        self._codes.reset()
        self._path.reset()
        self._frames = 0
        self._last_stamp_ns = None

    def _pair(self, shift: Shift | None, stamp_ns: int) -> Update:
        step, status = self._judge(shift)
        if step.appended:
            self._path.append(step.direction, stamp_ns)
        tip = self._path.tip
        assert tip is not None
        return Update(self._frames - 2, stamp_ns, shift, step, status, tip)

    def _judge(self, shift: Shift | None) -> tuple[Step, PairStatus]:
        if shift is None:
            self.counters.reprimed += 1
            return self._codes.skip(end_turn=True), PairStatus.REPRIMED
        if shift.response == 0.0:
            self.counters.unmeasured += 1
            return self._codes.skip(), PairStatus.NO_MEASUREMENT
        step = self._codes.update(shift.dx)
        return step, PairStatus.OK if step.appended else PairStatus.TURNING
