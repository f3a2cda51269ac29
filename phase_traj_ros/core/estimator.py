# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The complete pipeline for one camera, from a frame and its stamp to the result of a pair."""

import math
import time

import numpy as np
from numpy.typing import ArrayLike, NDArray
from phase_traj_ros.core.calibration.column_calibration import ColumnCalibration
from phase_traj_ros.core.calibration.lens_calibration import LensCalibration
from phase_traj_ros.core.calibration.self_calibration import SelfCalibration
from phase_traj_ros.core.camera.lens import ASSUMED_HFOV_DEG, Lens, LensOrigin
from phase_traj_ros.core.codes.chain import ChainCode
from phase_traj_ros.core.codes.links import LinkCode
from phase_traj_ros.core.codes.threshold_hint import ThresholdHint
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.frames.jitter import StampJitter
from phase_traj_ros.core.frames.prepare import prepare
from phase_traj_ros.core.frames.repeats import RepeatDetector
from phase_traj_ros.core.heading.turns import Turn
from phase_traj_ros.core.heading.visual_compass import VisualCompass
from phase_traj_ros.core.heading.yaw_camera import YawCamera
from phase_traj_ros.core.integration import Integration
from phase_traj_ros.core.judge import judge
from phase_traj_ros.core.measuring import PairMeter, PairTimes
from phase_traj_ros.core.path.heading_path import DrawnPath
from phase_traj_ros.core.path.way import Way
from phase_traj_ros.core.reliability.verdict import Reliability
from phase_traj_ros.core.settings import CodeSource, EstimatorSettings
from phase_traj_ros.core.update import Update
from phase_traj_ros.errors import FrameError


class TrajectoryEstimator:
    """
    Measures each pair of frames of a camera, codes it, and draws the path.

    ``update`` takes a frame through all steps: it is prepared, measured, judged and integrated.
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
            The mask is not (H, W), holds a negative value, NaN or infinity, or is empty (0
            everywhere) within the view.

        """
        self._settings = settings or EstimatorSettings()
        self._meter = PairMeter(self._settings, mask=mask)
        self._integration = Integration(self._settings)
        self._repeats = RepeatDetector()
        self._jitter = StampJitter()
        self._width = 0
        self.measure_ns = 0
        """Time to prepare and measure the newest frame, in nanoseconds."""
        self.last_stamp_ns: int | None = None
        """Stamp of the newest frame in nanoseconds; None before the first."""
        self.counters = self._integration.counters
        """Counts since the estimator was made."""
        # Stamps of the newest frame that repeats no picture, and of the newest measured one.
        self._used_stamp_ns = self._measured_ns = 0
        if self._settings.lens is not None:
            self.use_lens(self._settings.lens)
        elif self._settings.learns_lens:
            self._make_heading(
                Lens(hfov_deg=ASSUMED_HFOV_DEG, assumed=True,
                     pitch_deg=self._settings.camera_pitch_deg), learning=LensCalibration())

    @property
    def settings(self) -> EstimatorSettings:
        """Return the settings in use."""
        return self._settings

    @property
    def codes(self) -> ChainCode:
        """Return both chain codes so far."""
        return self._integration.coder.codes

    @property
    def links(self) -> LinkCode | None:
        """Return the chain code of equal links so far; None if the settings disable it."""
        return self._integration.route.links

    @property
    def way(self) -> Way:
        """Return the distance travelled so far."""
        return self._integration.route.way

    @property
    def heading(self) -> VisualCompass | None:
        """Return the visual compass; None if no lens is known."""
        return self._integration.heading

    @property
    def turns(self) -> tuple[Turn, ...]:
        """Return the turns that have ended, oldest first, at most ``max_runs``."""
        return tuple(self._integration.turns)

    @property
    def path(self) -> DrawnPath:
        """Return the drawn trajectory so far."""
        return self._integration.route.drawn

    @property
    def frames(self) -> int:
        """Return the number of frames since the last reset: one more than movement codes."""
        return self._integration.frames

    @property
    def newest_speed_ns(self) -> int | None:
        """Return the stamp of the newest speed in nanoseconds; None before the first."""
        return self._integration.distance_meter.speeds.newest_ns

    @property
    def reliability(self) -> Reliability:
        """
        Return whether the last minute is reliable, and if not, why.

        ``Reliability.of_drive`` is the verdict on all of the drive so far.
        """
        return self._integration.reliability

    @property
    def left_out(self) -> NDArray[np.uint8] | None:
        """
        Return a map of the upright image, (H, W), that is 0 in areas fixed to the camera.

        None if there are none.
        """
        return self._meter.excluded

    @property
    def threshold_hint(self) -> ThresholdHint | None:
        """Return the hint for an unsuitable threshold; None if the threshold may fit."""
        return self._integration.coder.shifts.hint(self._width)

    def correlation_map(self) -> NDArray[np.float32]:
        """
        Return the map of the newest pair; see ``PhaseCorrelator.correlation_map``.

        If the codes come from the heading, it is the map on the cylinder.
        """
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
        if self.heading is not None:
            if lens not in (self.heading.camera.lens, self.heading.camera.given):
                self._integration.trusted = None
                self._repeats = RepeatDetector()
            self.heading.use_lens(lens)
        elif self._settings.measures_heading:
            # The principal point of a camera is rarely at the centre of its images.
            learns = (self._settings.code_source is CodeSource.AUTO and lens.offset == 0.0
                      and lens.origin is LensOrigin.GIVEN)
            self._make_heading(lens, learning=ColumnCalibration(lens) if learns else None)
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
        self._integration.distance_meter.speeds.add(stamp_ns, speed)

    def repeat_stamp(self, count: int) -> None:
        """Count frames that are not used because their stamp equals the previous one."""
        self._integration.repeat_stamp(count)

    def skip(self) -> None:
        """Count a frame that could not be read, decoded or used."""
        self._integration.skip()

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
        ``max_runs`` and ``max_corners`` change with the next reset. A change between AUTO and
        SHIFT restarts codes and path.

        Raises
        ------
        ValueError
            See ``check``. The state is unchanged.

        """
        self.check(settings)
        switches = self._switches_rule(settings)
        self._settings = settings
        self._repeats = RepeatDetector()
        self._meter.reconfigure(settings)
        self._integration.reconfigure(settings)
        if switches:
            self.reset()

    def reset(self) -> None:
        """Restart with the next frame: no codes, no path, direction forward."""
        self._meter.reset()
        self._repeats = RepeatDetector()
        self._jitter = StampJitter()
        self._integration.reset()
        self.last_stamp_ns = None

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
        if self.last_stamp_ns is not None and stamp_ns <= self.last_stamp_ns:
            raise FrameError(
                f'its stamp, {stamp_ns} ns, is not after that of the previous frame,'
                f' {self.last_stamp_ns} ns: give the frames to a FrameStream, which drops late'
                ' ones, or call reset()')
        if self._settings.measures_heading and self.heading is None:
            raise FrameError(
                'the camera is unknown, and a focal length is required: publish its camera_info,'
                ' or set focal_px or hfov_deg')
        began = time.perf_counter_ns()
        first = self.last_stamp_ns is None
        interval_ns = 0 if first else stamp_ns - self._used_stamp_ns
        waited_ns = 0 if first else stamp_ns - self._measured_ns
        # First, as an unusable frame must not change the state.
        frame = self._settings.view.upright(frame)
        picture = prepare(frame)
        # By the rule of the paper, the code of a pair does not depend on earlier motion.
        if not first and self._repeats.is_repeated(
                frame, interval_ns, encoding=encoding, by_motion=self._settings.by_heading):
            self._count(stamp_ns)
            self.measure_ns = 0
            return self._integration.repeat(stamp_ns, interval_ns)
        times = PairTimes(
            waited_ns * 1e-9, interval_ns * 1e-9,
            0.0 if first else self._interval_deviation(stamp_ns))
        pair = None
        if not self._is_foreseen(frame, picture, times, encoding):
            pair = self._meter.measure(
                frame, picture, times, encoding=encoding, known=self._integration.motion)
        self.measure_ns = time.perf_counter_ns() - began
        self._repeats.keep(picture if frame.dtype == np.uint8 else frame.copy(), encoding=encoding)
        self._used_stamp_ns, self._width = stamp_ns, frame.shape[1]
        self._count(stamp_ns)
        if pair is None:
            return self._integration.foresee(stamp_ns, waited_ns, interval_ns)
        self._measured_ns = stamp_ns
        if first:
            self._integration.start(stamp_ns)
            return None
        if pair.cut and self._settings.guards:
            self._integration.begin_scene()
        verdict = judge(
            pair, admitted=self.heading is None or self.heading.admits(pair.yaw, times.waited),
            by_yaw=self._settings.by_heading)
        return self._integration.add(
            pair, verdict, stamp_ns, waited_ns, interval_deviation=times.deviation)

    def _count(self, stamp_ns: int) -> None:
        """Count a frame that can be used."""
        if self.last_stamp_ns is not None:
            self._jitter.add(stamp_ns - self.last_stamp_ns)
        self.last_stamp_ns = stamp_ns
        self._integration.count_frame()

    def _interval_deviation(self, stamp_ns: int) -> float:
        """Return the standard deviation of the interval that ends with a stamp, in seconds."""
        assert self.last_stamp_ns is not None
        return 1e-9 * math.hypot(
            self._repeats.deviation_ns, self._jitter.deviation_ns(stamp_ns - self.last_stamp_ns))

    def _is_foreseen(
        self, frame: Frame, picture: NDArray[np.uint8], times: PairTimes, encoding: str,
    ) -> bool:
        """Return whether a frame needs no measurement, as the motion continues."""
        # A video that repeats some of its pictures has the stamps of another clock, and the motion
        # until a frame is not known if its stamp may be off by as much as the interval.
        return (self._integration.trusted is not None and self._repeats.deviation_ns == 0.0
                and times.deviation < times.interval
                and self._meter.can_foresee(
                    frame, picture, times, encoding, self._integration.motion.speed))

    def _switches_rule(self, settings: EstimatorSettings) -> bool:
        """Return whether settings change from the turns to the rule of the paper, or back."""
        return {settings.code_source, self._settings.code_source} == {
            CodeSource.AUTO, CodeSource.SHIFT} and (
                self.heading is not None or not settings.measures_heading)

    def _make_heading(self, lens: Lens, *, learning: SelfCalibration | None = None) -> None:
        """Measure the heading with a lens from now on."""
        camera = YawCamera(
            lens, rotate_180=self._settings.view.rotate_180, mask=self._meter.mask,
            learning=learning)
        self._integration.heading, self._meter.camera = VisualCompass(camera), camera
