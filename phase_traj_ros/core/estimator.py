# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole chain for one camera: a frame and its stamp in, what the pair adds out."""

import math
import time
from dataclasses import asdict, dataclass, field, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from phase_traj_ros.core.block_motion import BlockMotion
from phase_traj_ros.core.chain_code import PAPER_THRESHOLD, ChainCode, DynamicChainCode, Step
from phase_traj_ros.core.heading import HeadingStep
from phase_traj_ros.core.heading_code import HeadingCode
from phase_traj_ros.core.heading_estimator import HeadingEstimator, HeadingUpdate, Lens
from phase_traj_ros.core.phase_correlation import Frame, PhaseCorrelator, Shift
from phase_traj_ros.core.quality import (
    GateSettings,
    MeasurementGate,
    StillnessDetector,
    StillnessSettings,
)
from phase_traj_ros.core.trajectory import ChainPath, Corner
from phase_traj_ros.core.turns import Turn
from phase_traj_ros.core.view import View
from phase_traj_ros.core.windows import Window
from phase_traj_ros.core.yaw_meter import YawMeasurement


class PairStatus(Enum):
    """How a pair of frames came to its movement code."""

    OK = 'ok'
    """Measured and judged: forward, or the pair on which a turn begins."""
    TURNING = 'turning'
    """Measured; the turn that began earlier goes on."""
    STILL = 'still'
    """The vehicle stands: nothing but noise and passers-by moves in the picture."""
    NO_MEASUREMENT = 'no_measurement'
    """The two frames have nothing in common, or one of them shows nothing."""
    GAP = 'gap'
    """The time between the two frames was longer than allowed."""
    REPRIMED = 'reprimed'
    """The frame's size or encoding changed, or a setting: there is none to compare it with."""


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

    def copy(self) -> 'Counters':
        """Return the counts as they are now."""
        return replace(self)

    def as_dict(self) -> dict[str, int]:
        """Return the counts by name."""
        return asdict(self)


class TrajectoryEstimator:
    """
    Follows one camera: correlates each frame with the one before, codes the shift, draws the path.

    The live node and the offline replay both drive this class, so their codes are the same.
    """

    def __init__(
        self, settings: EstimatorSettings | None = None, *,
        mask: NDArray[np.uint8] | None = None,
    ) -> None:
        """
        Make an estimator that waits for its first frame.

        Parameters
        ----------
        settings
            All that can be chosen; the defaults are the paper's.
        mask
            (H, W), how much each pixel of the frames counts, 0 for what never moves.

        Raises
        ------
        ValueError
            A setting is out of its range, or the mask leaves nothing.

        """
        self._settings = settings or EstimatorSettings()
        self._mask = mask
        self._correlator = self._make_correlator()
        lens = self._settings.lens
        self._heading = None if lens is None else HeadingEstimator(
            lens, rotate_180=self._settings.view.rotate_180, mask=mask)
        self._heading_codes = HeadingCode(max_runs=self._settings.max_runs)
        self._codes = DynamicChainCode(
            self._settings.threshold, confirm_frames=self._settings.confirm_frames,
            release_frames=self._settings.release_frames, max_runs=self._settings.max_runs)
        self._blocks = BlockMotion()
        self._stillness = StillnessDetector(self._settings.stillness)
        self._path = ChainPath(max_corners=self._settings.max_corners)
        self.counters = Counters()
        self.correlate_ns = 0
        """Nanoseconds that the last frame took to correlate."""
        self._frames = 0
        self._last_stamp_ns: int | None = None
        self._form: tuple[tuple[int, ...], str, str] | None = None

    @property
    def settings(self) -> EstimatorSettings:
        """Return the settings in force."""
        return self._settings

    @property
    def codes(self) -> ChainCode:
        """Return both chain codes so far."""
        return self._heading_codes if self._by_heading else self._codes

    @property
    def heading(self) -> HeadingEstimator | None:
        """Return what follows the heading, None where no lens is given."""
        return self._heading

    @property
    def _by_heading(self) -> bool:
        return self._settings.code_source is CodeSource.HEADING

    @property
    def path(self) -> ChainPath:
        """Return the drawn trajectory so far."""
        return self._path

    @property
    def frames(self) -> int:
        """Return the frames since the start or the last reset: one more than movement codes."""
        return self._frames

    @property
    def last_stamp_ns(self) -> int | None:
        """Return the stamp of the newest frame taken, None before the first."""
        return self._last_stamp_ns

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """
        Go on with other settings; codes and path are kept.

        If what is correlated changes, the next frame has none to be compared with. How much is
        kept (``max_runs``, ``max_corners``) is chosen at the start and stays.

        Raises
        ------
        ValueError
            A setting is out of its range; nothing has changed.

        """
        # The only one of these that can refuse a value comes first.
        self._codes.threshold = settings.threshold
        self._codes.confirm_frames = settings.confirm_frames
        self._codes.release_frames = settings.release_frames
        if settings.stillness != self._settings.stillness:
            self._stillness = StillnessDetector(settings.stillness)
        before = self._compared
        self._settings = settings
        if self._compared != before:
            self._correlator = self._make_correlator()
            self._blocks.reset()

    def _make_correlator(self) -> PhaseCorrelator:
        mask = None if self._mask is None else self._settings.view.of(self._mask)
        return PhaseCorrelator(window=self._settings.window, mask=mask)

    @property
    def _compared(self) -> tuple[object, ...]:
        """Return what two frames have to have in common to be compared."""
        return self._settings.window, self._settings.view, self._looks_closer

    def correlation_map(self) -> NDArray[np.float32]:
        """Return the map of the newest pair, as ``PhaseCorrelator.correlation_map`` does."""
        return self._correlator.correlation_map()

    def reset(self) -> None:
        """Start anew with the next frame: no codes, no path, direction forward."""
        self._correlator.reset()
        self._blocks.reset()
        if self._heading is not None:
            self._heading.forget_frame()
        self._forget()

    def update(self, frame: Frame, stamp_ns: int, *, encoding: str = '') -> Update | None:
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
        encoding
            What it was made from: frames of different encodings are not compared.

        Raises
        ------
        FrameError
            The frame cannot be used. It is as if it had never come.

        """
        if stamp_ns == self._last_stamp_ns:
            self.counters.repeated += 1
            return None
        began = time.perf_counter_ns()
        interval_ns = 0 if self._last_stamp_ns is None else stamp_ns - self._last_stamp_ns
        # First of all the frame has to be usable: one that is not must not change anything.
        pair = self._compare(frame, interval_ns * 1e-9)
        if interval_ns < 0:
            self.counters.time_resets += 1
            self._forget()
        form = (frame.shape, frame.dtype.str, encoding)
        if form != self._form:
            self._form = form
            pair = _Pair(None, None, pair.width, False)
        self.correlate_ns = time.perf_counter_ns() - began
        self._last_stamp_ns = stamp_ns
        self._frames += 1
        self.counters.frames += 1
        self._path.start(stamp_ns)
        if self._frames > 1:
            return self._pair(pair, stamp_ns, interval_ns)
        if self._heading is not None:
            self._heading.start(stamp_ns)
        return None

    def _compare(self, frame: Frame, interval: float) -> '_Pair':
        """Compare a frame with the one before it, in every way that is asked for."""
        view = self._settings.view.of(frame)
        shift, yaw = None, None
        if not self._by_heading:
            shift = self._correlator.update(view)
        if self._heading is not None:
            yaw = self._heading.measure(frame, max(interval, 1e-9))
        motion = self._looks_closer and self._blocks.update(view)
        return _Pair(shift, yaw, view.shape[1], motion)

    def _forget(self) -> None:
        self._codes.reset()
        self._heading_codes.reset()
        if self._heading is not None:
            self._heading.restart()
        self._stillness.reset()
        self._path.reset()
        self._frames = 0
        self._last_stamp_ns = None

    @property
    def _looks_closer(self) -> bool:
        """Return whether the frames have to be compared block by block, too."""
        return self._settings.gate is not None or self._settings.stillness is not None

    def _pair(self, pair: '_Pair', stamp_ns: int, interval_ns: int) -> Update:
        interval = interval_ns * 1e-9
        heading = None
        if self._heading is not None:
            heading = self._heading.add(
                None if self._is_gap(interval) else pair.yaw, stamp_ns, interval)
        if self._by_heading and heading is not None:
            shift = heading.shift
        else:
            shift = None if pair.shift is None else self._settings.view.full_shift(pair.shift)
        status, judged = self._judge(pair, heading, interval)
        step = self._step(status, judged, heading, interval)
        if status is PairStatus.OK and not step.appended:
            status = PairStatus.TURNING
        if step.appended:
            self._path.append(step.direction, stamp_ns)
        tip = self._path.tip
        assert tip is not None
        return Update(
            self._frames - 2, stamp_ns, interval_ns, None if status is PairStatus.GAP else shift,
            step, status, tip, None if heading is None else heading.step,
            () if heading is None else heading.turns)

    def _is_gap(self, interval: float) -> bool:
        return 0 < self._settings.max_gap < interval

    def _judge(
        self, pair: '_Pair', heading: HeadingUpdate | None, interval: float,
    ) -> tuple[PairStatus, Shift | None]:
        """Return what there is to say of a pair before it is coded, and the shift to code."""
        if self._is_gap(interval):
            self.counters.gaps += 1
            self._stillness.reset()
            return PairStatus.GAP, None
        if (pair.yaw if self._by_heading else pair.shift) is None:
            self.counters.reprimed += 1
            self._stillness.reset()
            return PairStatus.REPRIMED, None
        if self._by_heading:
            judged = heading.shift if heading is not None and heading.measured else None
        else:
            assert pair.shift is not None
            judged = self._measured(pair.shift)
        if judged is None:
            self.counters.unmeasured += 1
            return PairStatus.NO_MEASUREMENT, None
        if self._settings.stillness is not None and pair.motion and self._stillness.update(
                self._blocks.flow(), pair.width):
            self.counters.still += 1
            return PairStatus.STILL, None
        return PairStatus.OK, judged

    def _measured(self, shift: Shift) -> Shift | None:
        """Return the shift of the picture, or None if there is none to be had."""
        if shift.response == 0.0:
            return None
        if self._settings.gate is None:
            return shift
        gate = MeasurementGate(self._settings.gate)
        return gate.judge(shift, self._correlator, self._blocks)

    def _step(
        self, status: PairStatus, judged: Shift | None, heading: HeadingUpdate | None,
        interval: float,
    ) -> Step:
        if judged is None:
            return self.codes.skip(end_turn=status in (PairStatus.GAP, PairStatus.REPRIMED))
        if self._by_heading and heading is not None:
            return self._heading_codes.update(heading.step.heading, heading.step.rate)
        dx = self._settings.view.full_shift(judged).dx
        if self._settings.nominal_period > 0:
            # After a dropped frame the shift is that of two periods.
            dx *= self._settings.nominal_period / interval
        return self._codes.update(dx)


@dataclass(frozen=True, slots=True)
class _Pair:
    """What two frames have given."""

    shift: Shift | None
    """In pixels of the view."""
    yaw: YawMeasurement | None
    width: int
    """Of the view."""
    motion: bool
    """Whether both frames are at hand block by block."""
