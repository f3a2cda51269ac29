# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole chain for one camera: a frame and its stamp in, what the pair adds out."""

from collections import deque
from dataclasses import dataclass, replace
import time

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.field_of_view import ASSUMED_HFOV_DEG
from phase_traj_ros.core.camera.projection import threshold_px
from phase_traj_ros.core.codes.from_heading import HeadingCode
from phase_traj_ros.core.codes.from_shift import ChainCode, DynamicChainCode, Step
from phase_traj_ros.core.correlation.phase_correlation import (
    check_form,
    Frame,
    PhaseCorrelator,
    Shift,
)
from phase_traj_ros.core.correlation.quality import PairQuality, Verdict
from phase_traj_ros.core.heading.estimator import HeadingEstimator, HeadingUpdate, Lens
from phase_traj_ros.core.heading.turns import Turn
from phase_traj_ros.core.heading.yaw_meter import YawMeasurement
from phase_traj_ros.core.path.trajectory import DrawnPath
from phase_traj_ros.core.route import Route
from phase_traj_ros.core.settings import CodeSource, EstimatorSettings
from phase_traj_ros.core.update import Counters, PairStatus, Update
from phase_traj_ros.errors import FrameError


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
        MissingDependencyError
            The library that is to compute the transforms is not installed.

        """
        self._settings = settings or EstimatorSettings()
        self._mask = mask
        self._correlator = self._make_correlator()
        self._heading: HeadingEstimator | None = None
        if self._settings.lens is not None:
            self.use_lens(self._settings.lens)
        elif self._settings.estimate_fov:
            self._heading = self._make_heading(
                Lens(hfov_deg=ASSUMED_HFOV_DEG), calibrating=True)
        self._heading_codes = HeadingCode(
            connectivity=self._settings.connectivity, max_runs=self._settings.max_runs)
        self._codes = DynamicChainCode(
            self._settings.threshold, confirm_frames=self._settings.confirm_frames,
            release_frames=self._settings.release_frames, max_runs=self._settings.max_runs)
        self._quality = self._make_quality()
        self._route = Route(self._settings)
        self.counters = Counters()
        self._turns: deque[Turn] = deque(maxlen=self._settings.max_runs)
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
    def turns(self) -> tuple[Turn, ...]:
        """Return the turns that have ended, oldest first, as many as runs are kept."""
        return tuple(self._turns)

    @property
    def _by_heading(self) -> bool:
        return self._settings.code_source is CodeSource.HEADING

    @property
    def path(self) -> DrawnPath:
        """Return the drawn trajectory so far."""
        return self._route.drawn

    def use_lens(self, lens: Lens) -> None:
        """
        Go on with what is known of the camera now; the heading is kept.

        If that is something else than before, the next frame has none to be compared with.

        Raises
        ------
        ValueError
            The settings leave no room for a lens.

        """
        if not self._settings.measures_heading:
            raise ValueError('no lens was foreseen: give one, or awaits_lens, in the settings')
        if self._heading is None:
            self._heading = self._make_heading(lens)
        else:
            self._heading.use_lens(lens)

    def add_speed(self, stamp_ns: int, speed: float) -> None:
        """
        Take the vehicle's speed at a time, in metres per second, negative in reverse.

        Raises
        ------
        ValueError
            The speed is not from -1000 to 1000; nothing has changed.

        """
        self._route.speeds.add(stamp_ns, speed)

    @property
    def newest_speed_ns(self) -> int | None:
        """Return the stamp of the newest speed that has come, None before the first."""
        return self._route.speeds.newest_ns

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
        before, self._settings = self._settings, settings
        if self._heading is not None:
            self._heading.turn_180(settings.view.rotate_180)
        if (settings.window, settings.view) != (before.window, before.view):
            self._correlator = self._make_correlator()
            self._quality = self._make_quality()
        elif (settings.gate, settings.stillness) != (before.gate, before.stillness):
            self._quality = self._make_quality()

    def _make_heading(self, lens: Lens, *, calibrating: bool = False) -> HeadingEstimator:
        return HeadingEstimator(
            lens, rotate_180=self._settings.view.rotate_180, mask=self._mask,
            calibrating=calibrating, transform=self._settings.transform)

    def _make_correlator(self) -> PhaseCorrelator:
        return PhaseCorrelator(
            window=self._settings.window, mask=self._view_mask(),
            transform=self._settings.transform)

    def _make_quality(self) -> PairQuality:
        # The heading is measured otherwise, and has tests of its own.
        return PairQuality(
            gate=None if self._by_heading else self._settings.gate,
            stillness=self._settings.stillness, mask=self._view_mask())

    def _view_mask(self) -> Frame | None:
        return None if self._mask is None else self._settings.view.of(self._mask)

    def correlation_map(self) -> NDArray[np.float32]:
        """
        Return the map of the newest pair, as ``PhaseCorrelator.correlation_map`` does.

        Where the codes come from the heading, it is that of the cylinder.
        """
        if self._by_heading and self._heading is not None:
            return self._heading.correlation_map()
        return self._correlator.correlation_map()

    @property
    def threshold_px(self) -> float | None:
        """Return T of the newest pair in pixels per frame; None if the codes need none."""
        return None if self._by_heading else self._codes.threshold

    def reset(self) -> None:
        """Start anew with the next frame: no codes, no path, direction forward."""
        self._correlator.reset()
        self._quality.reset()
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
        if self._settings.measures_heading and self._heading is None:
            raise FrameError(
                'nothing is known of the camera yet, and a focal length is needed: publish its'
                ' camera_info, or give focal_px or hfov_deg')
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
            pair = _Pair(None, None)
            self._quality.reset()
        self.correlate_ns = time.perf_counter_ns() - began
        self._last_stamp_ns = stamp_ns
        self._frames += 1
        self.counters.frames += 1
        self._route.start(stamp_ns)
        if self._frames > 1:
            return self._pair(pair, stamp_ns, interval_ns)
        if self._heading is not None:
            self._heading.start(stamp_ns)
        return None

    def _compare(self, frame: Frame, interval: float) -> '_Pair':
        """Compare a frame with the one before it, in every way that is asked for."""
        view = self._settings.view.of(frame)
        shift, yaw = None, None
        if not self._by_heading or self._quality.looks_at_frames:
            # Before the heading has taken the frame; it may do with one of which the view is none.
            check_form(view)
        if self._heading is not None:
            yaw = self._heading.measure(frame, interval)
        if not self._by_heading:
            shift = self._correlator.update(view)
        self._quality.update(view)
        return _Pair(shift, yaw)

    def _forget(self) -> None:
        self._codes.reset()
        self._heading_codes.reset()
        self._turns.clear()
        if self._heading is not None:
            self._heading.restart()
        self._route.reset()
        self._frames = 0
        self._last_stamp_ns = None

    def _pair(self, pair: '_Pair', stamp_ns: int, interval_ns: int) -> Update:
        interval = interval_ns * 1e-9
        status, judged = self._judge(pair, interval)
        heading = self._follow(pair, status, stamp_ns, interval)
        if self._by_heading and heading is not None:
            shift = heading.shift
            if status is PairStatus.OK and not heading.measured:
                status = PairStatus.NO_MEASUREMENT
        else:
            shift = None if pair.shift is None else self._settings.view.full_shift(pair.shift)
        self.counters.count(status)
        step = self._step(status, judged, heading, interval)
        if status is PairStatus.OK and not step.appended:
            status = PairStatus.TURNING
        odometry = self._route.add(
            step, status, None if heading is None else heading.step, stamp_ns, interval_ns)
        tip = self.path.tip
        assert tip is not None
        return Update(
            self._frames - 2, stamp_ns, interval_ns, None if status is PairStatus.GAP else shift,
            step, status, tip, None if heading is None else heading.step,
            () if heading is None else heading.turns, odometry)

    def _judge(self, pair: '_Pair', interval: float) -> tuple[PairStatus, Shift | None]:
        """Return what there is to say of a pair before it is coded, and the shift to code."""
        if 0 < self._settings.max_gap < interval:
            self._quality.reset()
            return PairStatus.GAP, None
        measured = pair.shift
        if self._by_heading:
            measured = None if pair.yaw is None else pair.yaw.shift
        if measured is None:
            return PairStatus.REPRIMED, None
        verdict, judged = self._quality.judge(measured, self._correlator)
        if verdict is Verdict.NO_MEASUREMENT:
            return PairStatus.NO_MEASUREMENT, None
        return PairStatus.STILL if verdict is Verdict.STILL else PairStatus.OK, judged

    def _follow(
        self, pair: '_Pair', status: PairStatus, stamp_ns: int, interval: float,
    ) -> HeadingUpdate | None:
        """Add the pair's yaw to the heading, where that is measured."""
        if self._heading is None:
            return None
        measured = None if status is PairStatus.GAP else pair.yaw
        if status is PairStatus.STILL and measured is not None:
            # Whatever passes by: who stands does not turn.
            measured = replace(measured, yaw=0.0)
        update = self._heading.add(measured, stamp_ns, interval)
        self._turns.extend(update.turns)
        return update

    def _step(
        self, status: PairStatus, judged: Shift | None, heading: HeadingUpdate | None,
        interval: float,
    ) -> Step:
        if status is not PairStatus.OK or judged is None:
            return self.codes.skip(end_turn=status in (PairStatus.GAP, PairStatus.REPRIMED))
        if self._by_heading and heading is not None:
            return self._heading_codes.update(heading.step.heading, heading.step.rate)
        dx = self._settings.view.full_shift(judged).dx
        if self._settings.threshold_deg_s > 0 and self._heading is not None:
            self._codes.threshold = threshold_px(
                self._settings.threshold_deg_s, self._heading.focal_px, interval)
        elif self._settings.nominal_period > 0:
            # After a dropped frame the shift is that of two periods.
            dx *= self._settings.nominal_period / interval
        return self._codes.update(dx)


@dataclass(frozen=True, slots=True)
class _Pair:
    """What two frames have given."""

    shift: Shift | None
    """In pixels of the view."""
    yaw: YawMeasurement | None
