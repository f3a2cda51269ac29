# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Heading and turns of one camera whose focal length is known: frames in, yaw added up."""

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.calibration.field_of_view import FieldOfView
from phase_traj_ros.core.calibration.self_calibration import SelfCalibration
from phase_traj_ros.core.camera.estimate import CameraEstimate
from phase_traj_ros.core.camera.in_use import CameraInUse
from phase_traj_ros.core.camera.lens import Lens, LensOrigin
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.correlation.mask import check_size
from phase_traj_ros.core.correlation.phase_correlation import check_frame, Frame, Shift
from phase_traj_ros.core.correlation.transforms import TransformLibrary
from phase_traj_ros.core.heading.bends import Bends
from phase_traj_ros.core.heading.left_out import LeftOut
from phase_traj_ros.core.heading.tracker import HeadingStep, HeadingTracker
from phase_traj_ros.core.heading.turns import Turn, TurnDetector
from phase_traj_ros.core.heading.yaw_meter import YawMeasurement, YawMeter
from phase_traj_ros.errors import FrameError

# A vehicle drives straight on if it turns by less than this, radians per second, and drives if
# half of what is seen passes by more than this (way over distance).
_STRAIGHT, _DRIVING = math.radians(3.0), 0.01


@dataclass(frozen=True, slots=True)
class HeadingUpdate:
    """What one pair of frames adds to the heading."""

    step: HeadingStep
    shift: Shift | None
    """Shift of the picture in its middle, in pixels of the full frame; None if not comparable."""
    measured: bool
    """Whether the yaw was measured, and not bridged."""
    turns: tuple[Turn, ...]
    """Turns that are known to have ended."""
    quarters: tuple[int, ...]
    """Quarter turns that count from this pair on, in their order: 1 to the left, -1 right."""
    focal_px: float
    """Focal length that the yaw was measured with, in pixels of the full frame."""


class HeadingEstimator:
    """Measures the yaw of each pair, adds it up, and finds the turns."""

    def __init__(
        self, lens: Lens, *, rotate_180: bool = False, mask: NDArray[np.float32] | None = None,
        learning: SelfCalibration | None = None,
        transform: TransformLibrary = TransformLibrary.AUTO,
    ) -> None:
        """
        Make an estimator; the frames' size is learned from the first frame.

        Parameters
        ----------
        lens
            Focal length, field of view or calibration of the camera.
        rotate_180
            Whether it is mounted upside down.
        mask
            (H, W) from 0 to 1, how much each pixel of the frames counts.
        learning
            What learns the camera from the drive, where the lens is a guess: what it finds is used
            instead, and the heading so far is corrected.
        transform
            Which library computes the Fourier transforms.

        """
        self._lens = lens
        self._learning = learning
        self._learned = False
        # The newest frame, for a meter that takes over.
        self._newest: Frame | None = None
        self._rotate_180 = rotate_180
        self._left_out = LeftOut(mask)
        self._transform = transform
        self._meter: YawMeter | None = None
        self._shape: tuple[int, ...] = ()
        self._focal = (0.0, 0.0)
        self._tracker = HeadingTracker()
        self._turns = TurnDetector()
        self._bends = Bends()
        self._cut_short: list[Turn] = []
        self._mask_learning()

    @property
    def field_of_view(self) -> FieldOfView | None:
        """Return what the turns tell of the field of view, whatever the lens; None at first."""
        return self._bends.field_of_view

    @property
    def tracker(self) -> HeadingTracker:
        """Return what adds up the yaw."""
        return self._tracker

    @property
    def lens(self) -> Lens:
        """Return what is known of the camera."""
        return self._lens

    @property
    def learned(self) -> CameraEstimate | None:
        """Return what the drive has told of the camera; None before a turn, or if it is known."""
        if self._learning is None or self._learning.turns == 0:
            return None
        return self._learning.estimate

    @property
    def focal_px(self) -> float:
        """Return the (horizontal) focal length in pixels of the frames; 0 before the first."""
        return self._focal[0]

    @property
    def camera(self) -> CameraInUse | None:
        """Return what the camera is taken for now; None before the first frame."""
        return CameraInUse.of(self._lens, self._shape[1]) if self._shape else None

    @property
    def model(self) -> CameraModel:
        """
        Return the model of the upright picture.

        Raises
        ------
        ValueError
            There was no frame yet.

        """
        if not self._shape:
            raise ValueError('there was no frame yet: give one before asking for the model')
        camera = self._lens.camera_for((self._shape[0], self._shape[1]))
        return camera.turned_180() if self._rotate_180 and self._lens.calibrated else camera

    @property
    def counting(self) -> NDArray[np.float32] | None:
        """Return how much each pixel of the frames counts, (H, W) from 0 to 1; None: all alike."""
        return self._left_out.counting

    @property
    def bends_may_be_turns(self) -> bool:
        """Return whether a bend so far may have been a turn, as the camera may be another one."""
        camera = self.camera
        return camera is not None and self._bends.may_be_turns(camera)

    def use_lens(self, lens: Lens) -> None:
        """
        Go on with another lens (nothing happens if it is the same).

        The heading is kept, and corrected if the lens so far was a guess. The next frame has none
        to be compared with.
        """
        if lens == self._lens:
            return
        if self._learning is not None:
            # What was in use so far was a guess.
            self._correct(self._lens, lens)
            self._learning = self._newest = None
        self._lens = lens
        self._meter = None

    def turn_180(self, upside_down: bool) -> None:
        """Go on with the camera mounted this way up, as ``use_lens`` does."""
        if upside_down != self._rotate_180:
            self._rotate_180 = upside_down
            self._meter = None
            if self._learning is not None:
                # What it knows of the tilt was upside down.
                self._learning.forget()
            self._mask_learning()

    def leave_out(self, weights: NDArray[np.uint8] | None) -> None:
        """
        Go on without what is fixed to the camera; no pair is lost.

        Parameters
        ----------
        weights
            (H, W), how much each pixel of the frames counts besides the mask, 0 to 255; None for
            all alike.

        """
        self._left_out.use(weights)
        self._mask_learning()
        if self._meter is not None:
            self._meter.use_mask(self._left_out.counting)

    def cut(self) -> None:
        """
        Start a new piece: the pair that is added next is of another scene than those before.

        The heading and the turns are kept; a turn under way has ended.
        """
        self._tracker.cut()
        self._cut_short += self._turns.cut()
        self._bends.cut()
        if self._learning is not None:
            self._learning.cut()

    def restart(self) -> None:
        """Start anew at heading 0; the newest frame is the first. What is settled stays so."""
        self._tracker.reset()
        self._turns.reset()
        self._bends.restart()
        self._cut_short.clear()

    def forget_frame(self) -> None:
        """Do not compare the next frame with the one before; the heading is kept."""
        if self._meter is not None:
            self._meter.reset()

    def correlation_map(self) -> NDArray[np.float32]:
        """Return the map of the newest pair on the cylinder; (0, 0) before the first frame."""
        if self._meter is None:
            return np.zeros((0, 0), np.float32)
        return self._meter.correlation_map()

    def finish(self) -> list[Turn]:
        """Return the turn that is under way at the end, if it is one already."""
        if self._learning is not None:
            self._learning.finish()
        return self._turns.finish()

    def measure(self, frame: Frame, interval: float) -> YawMeasurement | None:
        """
        Return what the next frame tells, or None if there is none to compare it with.

        Raises
        ------
        FrameError
            The frame cannot be used. It is as if it had never come.

        """
        if self._meter is None or frame.shape != self._shape:
            self._meter = self._make_meter(frame)
        measurement = self._meter.update(frame, interval)
        if self._learning is not None:
            self._newest = frame
            # Not the shift of the whole: in a gentle bend, what passes by may outweigh the turn.
            yaw = None if measurement is None else measurement.yaw
            self._learned |= self._learning.update(
                _upright(frame) if self._rotate_180 else frame,
                0.0 if yaw is None else self._focal[0] * _tangent(yaw), interval)
        return measurement

    def start(self, stamp_ns: int) -> None:
        """Note the stamp of the first frame."""
        self._turns.update(stamp_ns, 0.0)
        self._bends.start(stamp_ns)

    def add(
        self, measurement: YawMeasurement | None, stamp_ns: int, interval: float,
    ) -> HeadingUpdate:
        """Add a pair's measurement, or bridge it where there is none."""
        if measurement is None:
            step = self._tracker.update(None, interval)
        else:
            yaw = measurement.yaw
            step = self._tracker.update(
                None if yaw is None else yaw / self._lens.tilt, interval,
                certain=measurement.certain, variance=measurement.variance)
            self._learn_from_travel(measurement, step)
        turns = (*self._cut_short, *self._turns.update(stamp_ns, step.heading))
        self._cut_short.clear()
        for angle_deg in self._bends.update(
                stamp_ns, step.heading, focal=self._focal[0] / self._shape[1]):
            if self._learning is not None:
                self._learning.add_turn(angle_deg, focal_px=self._focal[0])
        update = HeadingUpdate(
            step, self.shift_of(measurement), not step.bridged, turns, self._turns.quarters,
            self._focal[0])
        if self._learned:
            self._adopt()
        return update

    def shift_of(self, measurement: YawMeasurement | None) -> Shift | None:
        """Return the shift of the picture in its middle, in pixels of the full frame."""
        if measurement is None:
            return None
        shift = measurement.shift
        return Shift(
            self._focal[0] * _tangent(shift.dx / self._px_per_rad),
            shift.dy * (self._focal[1] / self._px_per_rad), shift.response)

    def _mask_learning(self) -> None:
        if self._learning is not None:
            self._learning.use_mask(self._left_out.as_seen(rotate_180=self._rotate_180))

    def _learn_from_travel(self, measurement: YawMeasurement, step: HeadingStep) -> None:
        """Learn the pitch from the direction of travel, straight on and with a camera learned."""
        motion = measurement.motion
        if (self._learning is None or motion is None or motion.passing < _DRIVING
                or self._lens.origin is not LensOrigin.DRIVE or abs(step.rate) > _STRAIGHT):
            return
        self._learning.add_travel(motion.travel.slope, math.sqrt(motion.travel.slope_variance))

    def _adopt(self) -> None:
        """Go on with the camera that the drive has told, where that makes a difference."""
        self._learned = False
        if self._learning is None or self._newest is None:
            return
        before, lens = self._lens, Lens(estimate=self._learning.estimate)
        if lens.is_close_to(before, self._newest.shape[1]):
            return
        self._lens = lens
        try:
            self._meter = self._make_meter(self._newest)
        except FrameError:
            # With that lens there would be nothing to measure: better a guess.
            self._lens = before
            return
        self._correct(before, lens)
        self._meter.update(self._newest, 0.0)

    def _correct(self, before: Lens, lens: Lens) -> None:
        """Correct all angles so far, which were measured with the lens ``before``."""
        if not self._shape:
            return
        factor = before.focal_for(self._shape[1]) / lens.focal_for(self._shape[1])
        for part in (self._tracker, self._turns, self._bends):
            part.scale(factor * before.tilt / lens.tilt)

    def _make_meter(self, frame: Frame) -> YawMeter:
        if frame.ndim != 2 or min(frame.shape) < 1:
            raise FrameError(f'frame has shape {frame.shape}: give grey frames (H, W)')
        if self._left_out.mask is not None:
            check_size(frame, self._left_out.mask)
        camera = self._lens.camera_for((frame.shape[0], frame.shape[1]))
        if self._rotate_180 and not self._lens.calibrated:
            # Numbers and estimates are about the upright picture, calibrations about the frames.
            camera = camera.turned_180()
        projection = CylinderProjection(camera, rotate_180=self._rotate_180)
        # A frame that will be refused must not change anything.
        check_frame(projection(frame))
        meter = YawMeter(projection, mask=self._left_out.mask, transform=self._transform)
        if self._left_out.keep_for(frame.shape):
            meter.use_mask(self._left_out.counting)
        self._focal = (camera.fx, camera.fy)
        self._px_per_rad = projection.px_per_rad
        self._shape = frame.shape
        return meter


def _tangent(angle: float) -> float:
    return math.tan(min(max(angle, -1.5), 1.5))


def _upright(frame: Frame) -> Frame:
    return np.ascontiguousarray(frame[::-1, ::-1])  # type: ignore[return-value]
