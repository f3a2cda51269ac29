# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures each pair of frames: its shift, its yaw, its distance, and what else it shows."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from phase_traj_ros.core.correlation.mask import check_size, mask_shares
from phase_traj_ros.core.correlation.phase_correlation import (
    check_form,
    Frame,
    PhaseCorrelator,
    Shift,
)
from phase_traj_ros.core.correlation.quality import GateSettings, PairQuality, Quality
from phase_traj_ros.core.fixed.guard import FixedGuard
from phase_traj_ros.core.heading.cuts import CutDetector
from phase_traj_ros.core.heading.yaw_camera import YawCamera
from phase_traj_ros.core.road.road_camera import RoadCamera
from phase_traj_ros.core.road.travel import Travel, TravelState
from phase_traj_ros.core.road.tuning import TUNING as ROAD
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement
from phase_traj_ros.core.settings import EstimatorSettings


# Significance of a valid shift, in standard deviations of noise.
_MIN_SIGNIFICANCE = GateSettings().min_significance


@dataclass(frozen=True, slots=True)
class Comparison:
    """The measurements of a pair; without any if its frames cannot be compared."""

    shift: Shift | None = None
    """Shift in pixels of the full frame, as measured."""
    yaw: YawMeasurement | None = None
    """Yaw, if a lens is given."""
    quality: Quality | None = None
    """Quality of the pair, given the fixed areas and traffic; None if it is not comparable."""
    dx: float | None = None
    """Shift to the right that is coded, in pixels of the full frame; None if the yaw is."""
    agreement: float = 0.0
    """Share of the image that agrees on its motion, 0 to 1; without blocks, 0 or 1."""
    gap: bool = False
    """Whether the interval between the frames exceeds the limit."""
    cut: bool = False
    """Whether the scene changed in the pair before."""
    blank: bool = False
    """Whether the image holds only noise."""
    fixed: bool = False
    """Whether only areas fixed to the camera may agree on the yaw, or leave too little."""
    slides: bool = False
    """Whether the road slides by all the same, so that the yaw counts."""
    travel: Travel | None = None
    """Distance on the road in camera heights; None if it is not measured."""


@dataclass(frozen=True, slots=True)
class PairTimes:
    """The times of a pair in seconds."""

    waited: float
    """Time since the newest frame that was compared; 0 for the first frame."""
    interval: float
    """Time since the previous frame, which need not have been compared."""
    deviation: float = 0.0
    """Standard deviation of the interval, and about that of ``waited``: both have the errors of
    two stamps."""


@dataclass(frozen=True, slots=True)
class KnownMotion:
    """The motion before a pair, as far as it is known."""

    speed: float | None = None
    """Speed in camera heights per second, negative in reverse; None if it is unknown."""
    yaw_rate: float = 0.0
    """Yaw rate in radians per second, positive to the left."""


class PairMeter:
    """
    Compares each frame with earlier ones, by all measurements.

    In ``auto``, areas that are fixed to the camera are detected and left out.
    """

    def __init__(self, settings: EstimatorSettings, *, mask: ArrayLike | None) -> None:
        """
        Make a meter that waits for its first frame, without a camera.

        Raises
        ------
        ValueError
            The mask is invalid (see ``mask_shares``), or it is empty within the view.

        """
        self._given_mask = None if mask is None else mask_shares(mask)
        self.mask = self._mask_of(settings)
        """Weight of each pixel of the upright image, (H, W), 0 to 1; None if all count equally."""
        self.camera: YawCamera | None = None
        """The camera that measures the yaw; None if no lens is known."""
        self._settings = settings
        self.check(settings)
        self._format: tuple[tuple[int, ...], str, str] | None = None
        self._cuts = CutDetector()
        self._guard = FixedGuard()
        self._road = RoadCamera(pitch_deg=settings.camera_pitch_deg)
        self._rebuild()

    @property
    def excluded(self) -> NDArray[np.uint8] | None:
        """Return the mask of the fixed areas, (H, W): 0 where fixed; None if nothing is."""
        return self._guard.excluded

    def check(self, settings: EstimatorSettings) -> None:
        """
        Check that the mask leaves a part of the view of these settings.

        Raises
        ------
        ValueError
            The mask is empty within the view.

        """
        mask = self._mask_of(settings)
        if mask is not None and not settings.view.of(mask).any():
            raise ValueError(
                f'mask is empty (0 everywhere) with a decimation of {settings.view.decimation}:'
                ' give less, or a mask that covers less')

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Apply other settings, which ``check`` has accepted."""
        before, self._settings = self._settings, settings
        turns_over = settings.view.rotate_180 != before.view.rotate_180
        self.mask = self._mask_of(settings)
        if turns_over or settings.code_source != before.code_source:
            self._guard = FixedGuard()
            self._exclude()
        if (settings.view, settings.code_source) != (before.view, before.code_source):
            self._rebuild()
        elif (settings.gate, settings.stillness) != (before.gate, before.stillness):
            self._make_quality()
        if turns_over and self.camera is not None:
            self.camera.turn_over(self.mask)

    def reset(self) -> None:
        """Forget the newest frame: the next one becomes the first of a pair."""
        self._correlator.reset()
        self._make_quality()
        self._cuts.reset()
        self._guard.interrupt()
        self._road.forget()
        if self.camera is not None:
            self.camera.forget_frame()

    def can_foresee(
        self, frame: Frame, picture: NDArray[np.uint8], times: PairTimes, encoding: str,
        speed: float | None,
    ) -> bool:
        """
        Return whether a frame needs no measurement, as the motion continues.

        For the parameters, see ``measure``; ``speed`` is that of ``KnownMotion``.
        """
        camera = self.camera
        return (
            camera is not None and self._settings.by_heading
            and self._format == _form(frame, encoding) and not self._gap(times.interval)
            and (self._road_camera is None or self._road.reaches(
                camera, (speed or 0.0) * (times.waited + times.interval)))
            and camera.foresees(picture, times.waited, times.interval))

    def measure(
        self, frame: Frame, picture: NDArray[np.uint8], times: PairTimes, *, encoding: str,
        known: KnownMotion,
    ) -> Comparison:
        """
        Compare a frame with earlier ones; without any, it is the first of a pair.

        ``picture`` is the frame as ``prepare`` returns it, ``known`` the motion before it.

        Raises
        ------
        FrameError
            The frame cannot be used. The state is unchanged.

        """
        guards, road_camera = self._settings.guards, self._road_camera
        pair = self._compare(
            frame, picture, times, encoding, speed=known.speed if guards else None)
        if times.waited == 0.0:
            if guards and self._guard.start(picture):
                self._exclude()
            if road_camera is not None:
                self._road.start(picture, road_camera)
            return pair
        if guards:
            pair = self._examine(pair, picture, times.waited, known)
        if road_camera is None:
            return pair
        travel = self._road.measure(
            picture, road_camera, pair.yaw, times.waited, still=pair.quality is Quality.STILL,
            interval_deviation=times.deviation)
        pair = replace(pair, travel=travel)
        if guards and travel.covered:
            return replace(pair, quality=Quality.MEASURED, fixed=True, slides=False)
        if pair.quality is Quality.STILL and travel.state is not TravelState.STANDING:
            # Of a straight road without texture, too little changes to be seen in the picture.
            return replace(pair, quality=Quality.MEASURED)
        if (guards and travel.rests and pair.quality is Quality.MEASURED
                and (pair.fixed or _may_follow_traffic(pair.yaw, times.waited))):
            return replace(pair, quality=Quality.STILL)
        return pair

    def correlation_map(self) -> NDArray[np.float32]:
        """
        Return the correlation map of the newest pair, see ``PhaseCorrelator``.

        If the codes come from the heading, it is the map on the cylinder.
        """
        if self._settings.by_heading and self.camera is not None:
            return self.camera.correlation_map()
        return self._correlator.correlation_map()

    @property
    def _road_camera(self) -> YawCamera | None:
        """Return the camera if the distance is measured on the road."""
        return self.camera if self._settings.measures_road else None

    def _examine(
        self, pair: Comparison, picture: NDArray[np.uint8], waited: float, known: KnownMotion,
    ) -> Comparison:
        """Return a pair with what the guard finds, and forget what was before a cut."""
        if pair.cut:
            self._guard.interrupt()
            # Before the road is measured, as it starts with the roll.
            if self.camera is not None:
                self.camera.cut()
            self._road.forget()
            known = KnownMotion()
        found = self._guard.examine(
            picture, pair.yaw, pair.quality, waited, speed=known.speed, yaw_rate=known.yaw_rate)
        if found.changed:
            self._exclude()
        return replace(pair, quality=found.quality, blank=found.blank, fixed=found.fixed,
                       slides=found.slides)

    def _compare(
        self, frame: Frame, picture: NDArray[np.uint8], times: PairTimes, encoding: str, *,
        speed: float | None,
    ) -> Comparison:
        """Measure shift, yaw and quality by the frames of the pair alone."""
        view = self._settings.view.of(frame)
        # All checks come first, because an error must leave the state unchanged.
        if not self._settings.by_heading or self._quality.needs_frames:
            # The yaw may be measured on a frame that is too small for the view.
            check_form(view)
            if self._view_mask is not None:
                check_size(view, self._view_mask)
        yaw = None if self.camera is None else self.camera.measure(
            picture, times.waited, speed=speed)
        shift = None if self._settings.by_heading else self._correlator.update(view)
        self._quality.update(view)
        frame_format = _form(frame, encoding)
        same_format, self._format = frame_format == self._format, frame_format
        gap = self._gap(times.interval)
        if gap or not same_format:
            self._quality.interrupt()
            self._cuts.reset()
            return Comparison(gap=gap)
        cut = self._cuts.update(yaw, times.interval)
        if cut and self._settings.guards:
            self._quality.interrupt()
        measured = yaw.shift if self._settings.by_heading and yaw is not None else shift
        if measured is None:
            return Comparison(yaw=yaw, cut=cut)
        quality, used = self._quality.judge(
            measured, self._correlator, times.waited)
        if yaw is not None:
            agreement = yaw.agreement
        else:
            agreement = float(self._correlator.significance(measured) >= _MIN_SIGNIFICANCE)
        if self._settings.by_heading:
            return Comparison(measured, yaw, quality, agreement=agreement, cut=cut)
        measured, used = map(self._settings.view.full_shift, (measured, used))
        return Comparison(measured, yaw, quality, used.dx, agreement, cut=cut)

    def _mask_of(self, settings: EstimatorSettings) -> NDArray[np.float32] | None:
        return None if self._given_mask is None else settings.view.upright(self._given_mask)

    def _gap(self, interval: float) -> bool:
        return 0.0 < self._settings.max_gap < interval

    def _rebuild(self) -> None:
        settings = self._settings
        self._view_mask: Frame | None = (
            None if self.mask is None else settings.view.of(self.mask))
        self._correlator = PhaseCorrelator(mask=self._view_mask)
        self._make_quality()

    def _make_quality(self) -> None:
        # The yaw is tested separately, and without a correlation map of the view.
        self._quality = PairQuality(
            gate=None if self._settings.by_heading else self._settings.gate,
            stillness=self._settings.stillness, mask=self._view_mask)
        self._exclude_from_quality()

    def _exclude(self) -> None:
        """Measure without the areas that are fixed to the camera, from the next pair on."""
        self._exclude_from_quality()
        if self.camera is not None:
            self.camera.exclude(self.excluded)

    def _exclude_from_quality(self) -> None:
        if not self._quality.needs_frames:
            return
        weights = self.excluded
        self._quality.exclude(None if weights is None else self._settings.view.of(weights))


def _may_follow_traffic(yaw: YawMeasurement | None, interval: float) -> bool:
    """Return whether the yaw of a standing vehicle is that of something else."""
    return yaw is None or yaw.yaw is None or not yaw.certain or (
        abs(yaw.yaw) > ROAD.driving_yaw_rate * interval)


def _form(frame: Frame, encoding: str) -> tuple[tuple[int, ...], str, str]:
    """Return what two frames must have in common to be compared."""
    return frame.shape, frame.dtype.str, encoding
