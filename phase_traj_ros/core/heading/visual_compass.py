# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures the heading and the turns from the frames of a camera with a known focal length."""

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.calibration.self_calibration import SelfCalibration
from phase_traj_ros.core.camera.estimate import CameraEstimate, FieldOfView
from phase_traj_ros.core.camera.in_use import CameraInUse
from phase_traj_ros.core.camera.lens import Lens, LensOrigin
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.correlation.mask import check_size
from phase_traj_ros.core.correlation.phase_correlation import check_frame, Shift
from phase_traj_ros.core.frames.pixel_weights import PixelWeights
from phase_traj_ros.core.heading.tracker import HeadingStep, HeadingTracker
from phase_traj_ros.core.heading.tuning import TUNING
from phase_traj_ros.core.heading.turns import Turn, TurnDetector
from phase_traj_ros.core.rotation.tuning import TUNING as YAW
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement, YawMeter
from phase_traj_ros.errors import FrameError


@dataclass(frozen=True, slots=True)
class HeadingUpdate:
    """Heading, shift and turns of one pair of frames."""

    step: HeadingStep
    shift: Shift | None
    """Shift at the centre of the image, in pixels of the full frame; None if not comparable."""
    turns: tuple[Turn, ...] = ()
    """Turns whose end was detected with this pair."""
    quarters: tuple[int, ...] = ()
    """Quarter turns that count from this pair on, in order: 1 to the left, -1 to the right."""
    contradicts: bool = False
    """Whether the direction that the quarter turns give contradicts the heading."""


class VisualCompass:
    """Measures the yaw of each pair, integrates it to the heading, and detects turns."""

    def __init__(
        self, lens: Lens, *, rotate_180: bool = False, mask: NDArray[np.float32] | None = None,
        learning: SelfCalibration | None = None, keyframes: bool = True,
    ) -> None:
        """
        Make a compass. The first frame sets the size of the frames.

        Parameters
        ----------
        lens
            Focal length, field of view or calibration of the camera.
        rotate_180
            Whether the camera is mounted upside down.
        mask
            Weight of each pixel of the frames, (H, W), 0 to 1.
        learning
            Self-calibration, if ``lens`` is a guess. The camera that it finds replaces ``lens``,
            and the heading so far is corrected.
        keyframes
            Whether a frame may be compared with an earlier one than its predecessor.

        """
        self._keyframes = keyframes
        self.lens = lens
        """Lens in use; ``use_lens`` changes it."""
        self._learning = learning
        self._learned = False
        # The newest frame, for a new meter.
        self._newest: NDArray[np.uint8] | None = None
        self._rotate_180 = rotate_180
        self._weights = PixelWeights(mask)
        self._meter: YawMeter | None = None
        self._shape: tuple[int, ...] = ()
        self._focal = (0.0, 0.0)
        self.tracker = HeadingTracker()
        """Tracker, which integrates the yaw."""
        self.tracker.scale_deviation = lens.focal_deviation
        self._turns = TurnDetector()
        self._response = 0.0
        self._mask_learning()

    @property
    def field_of_view(self) -> FieldOfView | None:
        """Return the field of view learned from the turns; None if it is not learned."""
        estimate = self.lens.estimate
        return None if estimate is None else estimate.field_of_view

    @property
    def learned(self) -> CameraEstimate | None:
        """Return the camera learned from the drive; None before a turn, or if it is known."""
        if self._learning is None or self._learning.turns == 0:
            return None
        return self._learning.estimate

    @property
    def focal_px(self) -> float:
        """Return the horizontal focal length in pixels of the frames; 0 before the first frame."""
        return self._focal[0]

    @property
    def camera(self) -> CameraInUse | None:
        """Return the camera in use; None before the first frame."""
        return CameraInUse.of(self.lens, self._shape[1]) if self._shape else None

    @property
    def model(self) -> CameraModel:
        """
        Return the camera model of the upright image.

        Raises
        ------
        ValueError
            It is called before the first frame.

        """
        if not self._shape:
            raise ValueError('the camera model is unknown before the first frame: give one first')
        camera = self.lens.camera_for((self._shape[0], self._shape[1]))
        return camera.turned_180() if self._rotate_180 and self.lens.calibrated else camera

    @property
    def counting(self) -> NDArray[np.float32] | None:
        """Return the weight of each pixel, (H, W), 0 to 1; None if all count equally."""
        return self._weights.counting

    @property
    def bends_may_be_turns(self) -> bool:
        """Return whether a bend so far may be a turn, given the uncertainty of the camera."""
        camera = self.camera
        return camera is not None and self._turns.widest_deg * camera.most_angle >= TUNING.turn_deg

    def use_lens(self, lens: Lens) -> None:
        """
        Continue with another lens; an equal lens has no effect.

        The heading is kept, and corrected if the previous lens was a guess. The next frame becomes
        the first of a pair.
        """
        if lens != self.lens:
            self._change(lens)
            self._meter = self._learning = self._newest = None

    def turn_180(self, upside_down: bool) -> None:
        """Continue with the camera mounted this way up; the next frame is the first of a pair."""
        if upside_down != self._rotate_180:
            self._rotate_180 = upside_down
            self._meter = None
            if self._learning is not None:
                # The learned tilt applies to the other mounting.
                self._learning.forget()
            self._mask_learning()

    def leave_out(self, weights: NDArray[np.uint8] | None) -> None:
        """
        Continue without the areas that are fixed to the camera; no pair is lost.

        Parameters
        ----------
        weights
            Weight of each pixel of the frames in addition to the mask, (H, W), 0 to 255; None if
            all count equally.

        """
        self._weights.use(weights)
        self._mask_learning()
        if self._meter is not None:
            self._meter.use_mask(self._weights.counting)

    def cut(self) -> None:
        """
        Start a new scene with the pair that is added next.

        The heading and the turns are kept; a turn in progress ends.
        """
        self.tracker.cut()
        self._turns.cut()
        if self._learning is not None:
            self._learning.cut()

    def restart(self) -> None:
        """Restart at heading 0 with the newest frame; a learned camera is kept."""
        self.tracker.reset()
        self._turns.reset()

    def forget_frame(self) -> None:
        """Make the next frame the first of a pair; the heading is kept."""
        if self._meter is not None:
            self._meter.reset()

    def correlation_map(self) -> NDArray[np.float32]:
        """Return the correlation map of the newest pair on the cylinder; (0, 0) at first."""
        if self._meter is None:
            return np.zeros((0, 0), np.float32)
        return self._meter.correlation_map()

    def finish(self) -> list[Turn]:
        """Return the turn in progress at the end, if it has reached the minimum angle."""
        if self._learning is not None:
            self._learning.finish()
        return self._turns.finish()

    def measure(self, frame: NDArray[np.uint8], interval: float) -> YawMeasurement | None:
        """
        Return the yaw measurement of the next frame, None for the first frame of a pair.

        Raises
        ------
        FrameError
            The frame cannot be used. The state is unchanged.

        """
        if (self._meter is not None and self.lens.focal_px
                and frame.shape[1:] != self._shape[1:]):
            raise FrameError(
                f'frames of {frame.shape[1]}x{frame.shape[0]} pixels after frames of'
                f' {self._shape[1]}x{self._shape[0]}, but focal_px is for one size: give hfov_deg'
                ' instead, or use_lens with the focal length for the new size')
        if self._meter is None or frame.shape != self._shape:
            self._meter = self._make_meter(frame, self.lens)
        measurement = self._meter.update(frame, interval)
        if self._learning is not None:
            self._newest = frame
            # Not the shift of the whole image: in a gentle bend, parallax may exceed the yaw.
            yaw = None if measurement is None else measurement.yaw
            self._learned |= self._learning.update(
                _upright(frame) if self._rotate_180 else frame,
                0.0 if yaw is None else self._focal[0] * _tangent(yaw), interval)
        return measurement

    def foresees(self, frame: NDArray[np.uint8], waited: float, interval: float) -> bool:
        """Return whether a frame needs no measurement; see ``YawMeter.foresees``."""
        return (self._meter is not None and frame.shape == self._shape
                and self._meter.foresees(frame, waited, interval))

    def foresee(self, waited: float) -> HeadingUpdate:
        """Return the update of a frame that is foreseen, ``waited`` seconds after the newest."""
        assert self._meter is not None
        step = self.tracker.foresee(waited, self._meter.foreseen_deviation)
        return HeadingUpdate(step, Shift(
            self._focal[0] * _tangent(step.yaw * self.lens.tilt), 0.0, self._response))

    def admits(self, measurement: YawMeasurement | None, interval: float) -> bool:
        """Return whether ``add`` would accept the yaw of a measurement; False without a yaw."""
        return measurement is not None and measurement.yaw is not None and self.tracker.admits(
            measurement.yaw / self.lens.tilt, interval, certain=measurement.certain)

    def start(self, stamp_ns: int) -> None:
        """Record the stamp of the first frame."""
        self._turns.update(stamp_ns, 0.0)
        if self._learning is not None:
            self._learning.see(stamp_ns)

    def add(
        self, measurement: YawMeasurement | None, stamp_ns: int, interval: float, *,
        way: float | None = None, frames: int = 1,
    ) -> HeadingUpdate:
        """
        Add the measurement of a pair; None bridges the pair.

        ``way`` is what the vehicle travels meanwhile, in heights of the camera; None if unknown.
        ``frames`` is the number of frames since the previous pair.
        """
        if self._learning is not None:
            self._learning.see(stamp_ns)
        if measurement is None:
            step = self.tracker.update(None, interval)
        else:
            yaw, self._response = measurement.yaw, measurement.shift.response
            step = self.tracker.update(
                None if yaw is None else yaw / self.lens.tilt, interval,
                certain=measurement.certain, variance=measurement.variance,
                share=measurement.share)
            self._learn_from_travel(measurement, step)
        turns = self._turns.update(stamp_ns, step.heading, way, frames=frames)
        if self._learning is not None:
            for angle_deg in self._turns.bends_deg:
                self._learning.add_turn(angle_deg, focal_px=self._focal[0])
        update = HeadingUpdate(
            step, self.shift_of(measurement), tuple(turns), self._turns.quarters,
            self._contradicts(step.heading))
        if self._learned:
            self._adopt()
        return update

    def shift_of(self, measurement: YawMeasurement | None) -> Shift | None:
        """Return the shift at the centre of the image, in pixels of the full frame."""
        if measurement is None:
            return None
        shift = measurement.shift
        return Shift(
            self._focal[0] * _tangent(shift.dx / self._px_per_rad),
            shift.dy * (self._focal[1] / self._px_per_rad), shift.response)

    def _contradicts(self, heading: float) -> bool:
        """Return whether the direction is too far from the heading, beyond what may be wrong."""
        own = math.hypot(self.lens.focal_deviation * heading, self.tracker.deviation)
        return math.radians(self._turns.aside_deg) > max(
            math.radians(TUNING.turn_deg), TUNING.contradicting_deviations * own)

    def _mask_learning(self) -> None:
        if self._learning is not None:
            self._learning.use_mask(self._weights.as_seen(rotate_180=self._rotate_180))

    def _learn_from_travel(self, measurement: YawMeasurement, step: HeadingStep) -> None:
        """Learn the pitch from the direction of travel, straight ahead with a learned camera."""
        motion = measurement.motion
        if (self._learning is not None and self.lens.origin is LensOrigin.DRIVE
                and motion is not None and motion.passing >= YAW.moving
                and abs(step.rate) <= YAW.straight_rate):
            self._learning.add_travel(
                motion.travel.slope, math.sqrt(motion.travel.slope_variance))

    def _adopt(self) -> None:
        """Continue with the camera learned from the drive, if it differs or is known better."""
        self._learned = False
        if self._learning is None or self._newest is None or self.camera is None:
            return
        lens = Lens(estimate=self._learning.estimate)
        if self.camera.settled and lens.is_close_to(self.lens, self._newest.shape[1]):
            return
        try:
            self._meter = self._make_meter(self._newest, lens)
        except FrameError:
            # The frames cannot be measured with this lens: keep the guess.
            return
        self._change(lens)
        self._meter.update(self._newest, 0.0)

    def _change(self, lens: Lens) -> None:
        """Use another lens; correct all angles that were measured with a guess."""
        if self._learning is not None and self._shape:
            before, width = self.lens, self._shape[1]
            factor = before.focal_for(width) / lens.focal_for(width) * before.tilt / lens.tilt
            self.tracker.scale(factor)
            self._turns.scale(factor)
        self.lens = lens
        self.tracker.scale_deviation = lens.focal_deviation

    def _make_meter(self, frame: NDArray[np.uint8], lens: Lens) -> YawMeter:
        if self._weights.mask is not None:
            check_size(frame, self._weights.mask)
        camera = lens.camera_for((frame.shape[0], frame.shape[1]))
        if self._rotate_180 and not lens.calibrated:
            # Numbers and estimates describe the upright image, calibrations the frames.
            camera = camera.turned_180()
        projection = CylinderProjection(camera, rotate_180=self._rotate_180)
        # A rejected frame must not change the state.
        check_frame(projection(frame))
        meter = YawMeter(
            projection, mask=self._weights.mask, keyframes=self._keyframes)
        if self._weights.keep_for(frame.shape):
            meter.use_mask(self._weights.counting)
        self._focal = (camera.fx, camera.fy)
        self._px_per_rad = projection.px_per_rad
        self._shape = frame.shape
        return meter


def _tangent(angle: float) -> float:
    return math.tan(min(max(angle, -1.5), 1.5))


def _upright(frame: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.ascontiguousarray(frame[::-1, ::-1])
