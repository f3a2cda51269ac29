# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The complete pipeline for one camera, from a frame and its stamp to the result of a pair."""

from collections import deque
from dataclasses import replace
import math
import time

import numpy as np
from numpy.typing import ArrayLike, NDArray
from phase_traj_ros.core.calibration.self_calibration import SelfCalibration
from phase_traj_ros.core.camera.in_use import CameraInUse
from phase_traj_ros.core.camera.lens import ASSUMED_HFOV_DEG, Lens
from phase_traj_ros.core.codes.chain import ChainCode
from phase_traj_ros.core.codes.links import LinkCode
from phase_traj_ros.core.codes.threshold_hint import ThresholdHint
from phase_traj_ros.core.coding import Coder
from phase_traj_ros.core.correlation.phase_correlation import Frame, Shift
from phase_traj_ros.core.distance_meter import DistanceMeter
from phase_traj_ros.core.frames.jitter import StampJitter
from phase_traj_ros.core.frames.prepare import prepare
from phase_traj_ros.core.frames.repeats import RepeatDetector
from phase_traj_ros.core.heading.turns import Turn
from phase_traj_ros.core.heading.visual_compass import HeadingUpdate, VisualCompass
from phase_traj_ros.core.judge import Judge, judged, Verdict
from phase_traj_ros.core.measuring import Comparison, PairMeter
from phase_traj_ros.core.path.trajectory import Corner, DrawnPath
from phase_traj_ros.core.path.way import Way
from phase_traj_ros.core.reliability.monitor import ReliabilityMonitor
from phase_traj_ros.core.reliability.reason import Evidence
from phase_traj_ros.core.reliability.verdict import Reliability
from phase_traj_ros.core.route import Route
from phase_traj_ros.core.settings import CodeSource, EstimatorSettings
from phase_traj_ros.core.status import PairStatus
from phase_traj_ros.core.update import Counters, Update
from phase_traj_ros.errors import FrameError


class TrajectoryEstimator:
    """
    Measures each pair of frames of a camera, codes it, and draws the path.

    The node and the offline replay use the same class, so their codes are the same.
    """

    def __init__(
        self, settings: EstimatorSettings | None = None, *, mask: ArrayLike | None = None,
    ) -> None:
        """
        Make an estimator that waits for its first frame.

        Parameters
        ----------
        settings
            Settings of the method; the defaults are those of the paper.
        mask
            Weight of each pixel of the frames, (H, W), 0 for areas that never move.

        Raises
        ------
        ValueError
            The mask is invalid (see ``mask_shares``), or it is empty within the view.
        MissingDependencyError
            The selected library for the transforms is not installed.

        """
        self._settings = settings or EstimatorSettings()
        self._meter = PairMeter(self._settings, mask=mask)
        self._heading: VisualCompass | None = None
        if self._settings.lens is not None:
            self.use_lens(self._settings.lens)
        elif self._settings.learns_lens:
            self._heading = self._make_heading(
                Lens(hfov_deg=ASSUMED_HFOV_DEG, assumed=True), learning=SelfCalibration())
        self._coder = Coder(self._settings)
        self._route = Route(self._settings)
        self._distance_meter = DistanceMeter(self._settings)
        self._judge = Judge(self._settings.code_source)
        self._monitor = ReliabilityMonitor()
        self._turned = False
        self._width = 0
        self.counters = Counters()
        self._turns: deque[Turn] = deque(maxlen=self._settings.max_runs)
        self.correlate_ns = 0
        """Time to correlate the last frame, in nanoseconds."""
        self._told: Lens | None = None
        self._repeats = RepeatDetector()
        self._jitter = StampJitter()
        self._frames = 0
        self._last_stamp_ns: int | None = None
        # Stamps of the newest frame that is not a repeated picture, and of the newest one that was
        # measured; the number of the latter.
        self._used_stamp_ns = self._measured_ns = self._measured = 0
        # Update of the newest measured frame, if it can be trusted, and that of the newest frame,
        # relative to it, if that was foreseen.
        self._steady: Update | None = None
        self._foreseen: Update | None = None

    @property
    def settings(self) -> EstimatorSettings:
        """Return the settings in use."""
        return self._settings

    @property
    def codes(self) -> ChainCode:
        """Return both chain codes so far."""
        return self._coder.codes

    @property
    def links(self) -> LinkCode | None:
        """Return the chain code of equal links so far; None if the settings disable it."""
        return self._route.links

    @property
    def way(self) -> Way:
        """Return the distance travelled so far."""
        return self._route.way

    @property
    def heading(self) -> VisualCompass | None:
        """Return the visual compass; None if no lens is known."""
        return self._heading

    @property
    def turns(self) -> tuple[Turn, ...]:
        """Return the turns that have ended, oldest first, at most ``max_runs``."""
        return tuple(self._turns)

    @property
    def path(self) -> DrawnPath:
        """Return the drawn trajectory so far."""
        return self._route.drawn

    @property
    def frames(self) -> int:
        """Return the number of frames since the last reset: one more than movement codes."""
        return self._frames

    @property
    def last_stamp_ns(self) -> int | None:
        """Return the stamp of the newest frame in nanoseconds; None before the first."""
        return self._last_stamp_ns

    @property
    def threshold_px(self) -> float | None:
        """Return T for the newest pair in pixels per frame; None if the codes need none."""
        return self._coder.threshold_px

    @property
    def newest_speed_ns(self) -> int | None:
        """Return the stamp of the newest speed in nanoseconds; None before the first."""
        return self._distance_meter.speeds.newest_ns

    @property
    def reliability(self) -> Reliability:
        """
        Return whether the last minute is reliable, and if not, why.

        ``Reliability.of_drive`` is the verdict on all of the drive so far.
        """
        return self._monitor.verdict(camera_known=not self._by_heading or self._knows_angles)

    @property
    def left_out(self) -> NDArray[np.uint8] | None:
        """Return an (H, W) map that is 0 in areas fixed to the camera; None if there are none."""
        return self._judge.left_out

    @property
    def threshold_hint(self) -> ThresholdHint | None:
        """Return what to do about a threshold that does not fit; None if it may fit."""
        return self._coder.hint(self._width)

    def correlation_map(self) -> NDArray[np.float32]:
        """
        Return the map of the newest pair; see ``PhaseCorrelator.correlation_map``.

        If the codes come from the heading, it is the map on the cylinder.
        """
        if self._by_heading and self._heading is not None:
            return self._heading.correlation_map()
        return self._meter.correlation_map()

    def use_lens(self, lens: Lens) -> None:
        """
        Continue with another lens; the heading is kept.

        If the lens differs from the previous one, the next frame becomes the first of a pair.

        Raises
        ------
        ValueError
            The heading is not measured, and no setting requires a lens.

        """
        if self._heading is not None:
            if lens != self._heading.lens:
                self._steady = None
                self._repeats.forget()
            self._heading.use_lens(lens)
        elif self._settings.measures_heading:
            self._heading = self._make_heading(lens)
        else:
            raise ValueError('no setting requires a lens: give the lens in the settings')

    def add_speed(self, stamp_ns: int, speed: float) -> None:
        """
        Add the speed of the vehicle at a stamp, in metres per second, negative in reverse.

        Raises
        ------
        ValueError
            The speed is not from -1000 to 1000. The state is unchanged.

        """
        self._distance_meter.speeds.add(stamp_ns, speed)

    def repeat_stamp(self, count: int) -> None:
        """Count frames with the stamp of the one before, which are not used."""
        self.counters.repeated += count
        self._monitor.add_same_stamps(count)

    def check(self, settings: EstimatorSettings) -> None:
        """
        Check that ``reconfigure`` accepts these settings, without a change of state.

        Raises
        ------
        ValueError
            The mask is empty within the view, or a setting that is fixed at the start differs.

        """
        self._settings.check_change(settings, switches_rule=self._switches_rule(settings))
        self._meter.check(settings)

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """
        Continue with other settings; codes and path are kept.

        If the change affects the correlation, the next frame becomes the first of a pair.
        ``max_runs`` and ``max_corners`` do not change after the start. A change between AUTO and
        SHIFT restarts codes and path.

        Raises
        ------
        ValueError
            See ``check``. The state is unchanged.

        """
        self.check(settings)
        switches = self._switches_rule(settings)
        self._settings = settings
        self._steady = None
        self._repeats.forget()
        self._meter.reconfigure(settings)
        self._distance_meter.reconfigure(settings)
        self._coder.reconfigure(settings)
        if switches:
            self._coder = Coder(settings)
            self._judge = Judge(settings.code_source)
            self._leave_out()
            self._route = Route(settings)
            self.reset()
        if self._heading is not None:
            self._heading.turn_180(settings.view.rotate_180)

    def reset(self) -> None:
        """Restart with the next frame: no codes, no path, direction forward."""
        self._meter.reset()
        self._repeats.forget()
        if self._heading is not None:
            self._heading.forget_frame()
        self._forget()

    def update(self, frame: Frame, stamp_ns: int, *, encoding: str = '') -> Update | None:
        """
        Process the next frame; return the result of its pair.

        Return None for the first frame. The stamps have to increase: ``FrameStream`` sees to that.
        A frame that repeats the picture of the previous one, or is less than 2 ms later, measures
        nothing; the next pair covers its time.

        Parameters
        ----------
        frame
            (H, W) uint8, uint16 or float32, of any gain and offset; it may change afterwards,
            unless it is read-only.
        stamp_ns
            Time of the exposure in nanoseconds.
        encoding
            Encoding of the source image; frames of different encodings are not compared.

        Raises
        ------
        FrameError
            The frame cannot be used, or its stamp is not after the previous one. The state is
            unchanged.

        """
        if self._last_stamp_ns is not None and stamp_ns <= self._last_stamp_ns:
            raise FrameError(
                f'its stamp, {stamp_ns} ns, is not after that of the previous frame,'
                f' {self._last_stamp_ns} ns: give the frames to a FrameStream, which drops late'
                ' ones, or call reset()')
        if self._settings.measures_heading and self._heading is None:
            raise FrameError(
                'the camera is unknown, and a focal length is required: publish its camera_info,'
                ' or set focal_px or hfov_deg')
        began = time.perf_counter_ns()
        first = self._last_stamp_ns is None
        interval_ns = 0 if first else stamp_ns - self._used_stamp_ns
        waited_ns = 0 if first else stamp_ns - self._measured_ns
        # First, as an unusable frame must not change the state.
        picture = prepare(frame)
        # The codes of the paper are those of pairs, whatever was before them.
        if self._frames and self._repeats.is_repeated(
                frame, interval_ns, encoding=encoding, by_motion=self._by_heading):
            self._count(stamp_ns)
            return self._repeated(stamp_ns, interval_ns)
        pair = None
        if not self._is_foreseen(frame, picture, waited_ns, interval_ns, encoding):
            pair = self._meter.compare(
                frame, picture, waited_ns * 1e-9, interval_ns * 1e-9, encoding=encoding,
                heading=self._heading)
        self.correlate_ns = time.perf_counter_ns() - began
        self._repeats.keep(
            picture if frame.dtype == np.uint8 else frame.copy(), encoding=encoding)
        self._used_stamp_ns, self._width = stamp_ns, frame.shape[1]
        self._count(stamp_ns)
        if pair is None:
            return self._foresee(stamp_ns, waited_ns, interval_ns)
        self._measured_ns = stamp_ns
        if self._frames == 1:
            self._measured = 1
            self._start(picture, stamp_ns)
            return None
        if pair.cut and self._guards:
            self._begin_scene()
        verdict = self._judge.judge(picture, pair, self._heading, waited_ns * 1e-9)
        whole = self._integrate(picture, pair, verdict, stamp_ns, waited_ns)
        foreseen, self._foreseen, self._measured = self._foreseen, None, self._frames
        self._steady = whole if verdict.evidence is Evidence.TRUSTED else None
        return whole.after(foreseen)

    def _is_foreseen(
        self, frame: Frame, picture: NDArray[np.uint8], waited_ns: int, interval_ns: int,
        encoding: str,
    ) -> bool:
        """Return whether a frame needs no measurement, as the motion goes on."""
        # A video that repeats some of its pictures has the stamps of another clock.
        return (self._steady is not None and self._by_heading and self._heading is not None
                and self._repeats.unsure_ns == 0.0
                and self._meter.continues(frame, interval_ns * 1e-9, encoding)
                and self._distance_meter.reaches((waited_ns + interval_ns) * 1e-9)
                and self._heading.foresees(picture, waited_ns * 1e-9, interval_ns * 1e-9))

    def _foresee(self, stamp_ns: int, waited_ns: int, interval_ns: int) -> Update:
        """Add a frame that is not measured; the next pair covers its time."""
        newest, heading = self._steady, self._heading
        assert newest is not None and heading is not None
        ahead = heading.foresee(waited_ns * 1e-9)
        step = self._coder.code(PairStatus.OK, 0.0, ahead, interval_ns * 1e-9)
        share = waited_ns / newest.interval_ns
        travel = newest.travel and newest.travel.part(share * newest.travel.distance, share)
        odometry = self._route.foresee(step, ahead.step, travel, stamp_ns, waited_ns)
        before, self._foreseen = self._foreseen, replace(
            newest, pair=self._frames - 2, stamp_ns=stamp_ns, interval_ns=waited_ns,
            shift=ahead.shift, step=step, status=PairStatus.OK.coded(step), tip=self._tip,
            heading=ahead.step, turns=(), camera=self._news_of_camera(), cut=False,
            odometry=odometry, travel=travel, links=())
        return self._foreseen.after(before)

    @property
    def _guards(self) -> bool:
        """Return whether cuts and fixed areas are acted on."""
        return self._settings.code_source is CodeSource.AUTO

    @property
    def _by_heading(self) -> bool:
        return self._settings.code_source is not CodeSource.SHIFT

    @property
    def _knows_angles(self) -> bool:
        """Return whether the camera is known well enough for the turns so far."""
        heading = self._heading
        if heading is None or heading.camera is None or heading.camera.settled:
            return True
        return not (self._turned or heading.bends_may_be_turns)

    def _switches_rule(self, settings: EstimatorSettings) -> bool:
        """Return whether settings change from the turns to the rule of the paper, or back."""
        return {settings.code_source, self._settings.code_source} == {
            CodeSource.AUTO, CodeSource.SHIFT} and (
                self._heading is not None or not settings.measures_heading)

    def _make_heading(
        self, lens: Lens, *, learning: SelfCalibration | None = None,
    ) -> VisualCompass:
        return VisualCompass(
            lens, rotate_180=self._settings.view.rotate_180, mask=self._meter.mask,
            learning=learning, keyframes=self._settings.keyframes)

    def _forget(self) -> None:
        self._coder.reset()
        self._turns.clear()
        if self._heading is not None:
            self._heading.restart()
        self._judge.reset()
        self._monitor.reset()
        self._turned = False
        self._distance_meter.reset()
        self._route.reset()
        self._frames = 0
        self._last_stamp_ns = self._steady = self._foreseen = None

    def _count(self, stamp_ns: int) -> None:
        if self._last_stamp_ns is not None:
            self._jitter.add(stamp_ns - self._last_stamp_ns)
        self._last_stamp_ns = stamp_ns
        self._frames += 1
        self.counters.frames += 1

    def _start(self, picture: Frame, stamp_ns: int) -> None:
        """Start with the first frame."""
        self._route.start(stamp_ns)
        self._judge.look(picture, None, 0.0)
        if self._heading is not None:
            self._heading.start(stamp_ns)
        self._distance_meter.start(picture, self._heading)

    def _begin_scene(self) -> None:
        """Separate the pair from those before a cut in the video."""
        self._distance_meter.reset()
        if self._heading is not None:
            self._heading.cut()

    def _integrate(
        self, picture: Frame, pair: Comparison, verdict: Verdict, stamp_ns: int, interval_ns: int,
    ) -> Update:
        """Add a judged pair to the heading, the codes, the distance and the path."""
        interval = interval_ns * 1e-9
        if verdict.areas_changed:
            self._leave_out()
        heading = self._turn(verdict, stamp_ns, interval)
        self.counters.count(verdict.status)
        dx = None if pair.used is None else self._settings.view.full_shift(pair.used).dx
        step = self._coder.code(verdict.status, dx, heading, interval)
        status = verdict.status.coded(step)
        turned = None if heading is None else heading.step
        # The road shows whether the vehicle moves, even if the rest of the image does not.
        unsure_ns = math.hypot(self._repeats.unsure_ns, self._jitter.deviation_ns)
        travel = self._distance_meter.update(
            picture, self._heading, pair.yaw, status, stamp_ns, interval_ns, unsure_ns=unsure_ns)
        progress = self._route.add(
            step, turned, travel, stamp_ns, interval_ns, unsure_ns=unsure_ns)
        cut = pair.cut and self._guards
        if pair.cut:
            self._monitor.add_cut()
        self._monitor.add(
            verdict.evidence, stamp_ns, interval_ns,
            contradicted=self._guards and heading is not None and heading.contradicts,
            measured=not self._settings.metric or travel is None or travel.measured,
            rivalled=self._settings.metric and travel is not None and travel.rivalled,
            frames=self._frames - self._measured)
        known = travel is not None and travel.known
        return Update(
            self._frames - 2, stamp_ns, interval_ns, self._shift(pair, heading), step, status,
            self._tip, turned, () if heading is None else heading.turns, self._news_of_camera(),
            cut, progress.odometry, travel, progress.links,
            travel.distance / interval if travel and known else None,
            travel.variance / interval ** 2 if travel and known else None)

    def _repeated(self, stamp_ns: int, interval_ns: int) -> Update:
        """Add a frame that repeats a picture; the next pair covers its time."""
        status, evidence = judged(Comparison(), repeated=True)
        self.counters.count(status)
        self._monitor.add(evidence, stamp_ns, interval_ns)
        heading = None if self._heading is None else self._heading.hold(
            None if self._foreseen is None else self._foreseen.heading)
        step = self._coder.code(status, None, heading, interval_ns * 1e-9)
        return Update(
            self._frames - 2, stamp_ns, interval_ns, None, step, status, self._tip,
            None if heading is None else heading.step, camera=self._news_of_camera())

    def _leave_out(self) -> None:
        """Measure without the areas that are fixed to the camera, from the next pair on."""
        self._meter.leave_out(self._judge.left_out)
        if self._heading is not None:
            self._heading.leave_out(self._judge.left_out)

    def _turn(self, verdict: Verdict, stamp_ns: int, interval: float) -> HeadingUpdate | None:
        """Add the yaw of the pair to the heading, if the heading is measured."""
        if self._heading is None:
            return None
        speed = self._distance_meter.heights_per_second
        update = self._heading.add(
            verdict.yaw, stamp_ns, interval, way=None if speed is None else speed * interval,
            frames=self._frames - self._measured)
        self._turns.extend(update.turns)
        self._turned |= bool(update.quarters or update.turns)
        return update

    @property
    def _tip(self) -> Corner:
        tip = self.path.tip
        assert tip is not None
        return tip

    def _news_of_camera(self) -> CameraInUse | None:
        """Return the camera if it has changed since the last report."""
        if self._heading is None or self._heading.lens is self._told:
            return None
        self._told = self._heading.lens
        return self._heading.camera

    def _shift(self, pair: Comparison, heading: HeadingUpdate | None) -> Shift | None:
        """Return the shift to report, in pixels of the full frame."""
        if self._by_heading:
            return None if heading is None else heading.shift
        return None if pair.shift is None else self._settings.view.full_shift(pair.shift)
