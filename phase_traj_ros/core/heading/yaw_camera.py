# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures the yaw in the frames of a camera, whose lens is given or learned from the drive."""

from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.calibration.self_calibration import SelfCalibration
from phase_traj_ros.core.camera.estimate import CameraEstimate, FieldOfView
from phase_traj_ros.core.camera.in_use import CameraInUse
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.correlation.mask import check_size
from phase_traj_ros.core.correlation.phase_correlation import Shift
from phase_traj_ros.core.frames.pixel_weights import PixelWeights
from phase_traj_ros.core.rotation.camera_roll import CameraRoll
from phase_traj_ros.core.rotation.focus_of_expansion import Mounting
from phase_traj_ros.core.rotation.tuning import TUNING
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement, YawMeter
from phase_traj_ros.errors import FrameError


class YawCamera:
    """
    Measures the yaw of each pair of frames.

    The lens may change: to another one that is given, and to better ones that are learned from the
    drive.
    """

    def __init__(
        self, lens: Lens, *, rotate_180: bool = False, mask: NDArray[np.float32] | None = None,
        learning: SelfCalibration | None = None,
    ) -> None:
        """
        Make a camera. The first frame sets the size of the frames.

        Parameters
        ----------
        lens
            Focal length, field of view or calibration of the camera.
        rotate_180
            Whether the camera is mounted upside down. The frames are upright all the same, but its
            calibration is not.
        mask
            Weight of each pixel of the frames, (H, W), 0 to 1.
        learning
            Self-calibration, if ``lens`` is not all that is to be known. What it finds replaces
            ``lens``.

        """
        self.lens = self.given = lens
        """Lens in use, and the one that was given or assumed before anything was learned."""
        self._learning = learning
        self._learned = False
        # The newest frame, for a new meter.
        self._newest_frame: NDArray[np.uint8] | None = None
        self.rotate_180 = rotate_180
        """Whether the camera is mounted upside down."""
        self._weights = PixelWeights(mask)
        self._meter: YawMeter | None = None
        self._shape: tuple[int, ...] = ()
        self._focal = (0.0, 0.0)
        self._update_learning_mask()

    @property
    def field_of_view(self) -> FieldOfView | None:
        """Return the field of view learned from the turns; None if it is not learned."""
        estimate = self.lens.estimate
        return None if estimate is None else estimate.field_of_view

    @property
    def learned(self) -> CameraEstimate | None:
        """Return the camera learned from the drive; None before a turn, or if it is known."""
        learning = self._learning
        return learning.estimate if learning is not None and learning.turns else None

    @property
    def contradicted(self) -> bool:
        """Return whether the turns contradict a lens that was given."""
        return self._learning is not None and self._learning.contradicted

    @property
    def focal_px(self) -> float:
        """Return the horizontal focal length in pixels of the frames; 0 before the first frame."""
        return self._focal[0]

    @property
    def tilt(self) -> float:
        """
        Return the cosine of the angle between the vertical image axis and the vertical.

        A tilted camera measures only this fraction of a turn as yaw. The roll is the current one.
        The pitch of a calibrated camera is that of the direction of travel; a camera that is
        learned from turns is learned with its pitch.
        """
        level = (math.cos(self.lens.horizon.pitch) if self.lens.is_guess or self._meter is None
                 else self._meter.mounting.level)
        return math.cos(self.roll.current) * level

    @property
    def roll(self) -> CameraRoll:
        """Return the roll of the camera, relative to the vertical and to the road."""
        return CameraRoll(self.lens.horizon) if self._meter is None else self._meter.roll

    @property
    def azimuth(self) -> float:
        """Return the azimuth in the image of travel straight ahead, in radians, right positive."""
        return 0.0 if self._meter is None else self._meter.mounting.angle

    @property
    def in_use(self) -> CameraInUse | None:
        """Return the camera in use; None before the first frame."""
        return CameraInUse.of(self.lens, self.width) if self._shape else None

    @property
    def model(self) -> CameraModel:
        """Return the camera model of the upright image, for frames like the newest one."""
        return self._model_of(self.lens, self._shape)

    @property
    def width(self) -> int:
        """Return the width of the newest frame in pixels; 0 before the first."""
        return self._shape[1] if self._shape else 0

    @property
    def pixel_weights(self) -> NDArray[np.float32] | None:
        """Return the weight of each pixel, (H, W), 0 to 1; None if all count equally."""
        return self._weights.current

    def use_lens(self, lens: Lens) -> float | None:
        """
        Continue with another lens; the next frame becomes the first of a pair.

        Return the factor that corrects the angles that were measured with the previous lens, 1 if
        that was not a guess. An equal lens has no effect: the factor is None.
        """
        if lens in (self.lens, self.given):
            return None
        factor = self._set_lens(lens)
        self.given = lens
        self._meter = self._learning = self._newest_frame = None
        return factor

    def turn_over(self, mask: NDArray[np.float32] | None) -> None:
        """
        Continue with the camera mounted the other way up, and the mask of the upright frames.

        The next frame is the first of a pair.
        """
        self.rotate_180 = not self.rotate_180
        self._weights = PixelWeights(mask)
        self._meter = None
        if self.lens != self.given:
            self.lens = self.lens.turned_180()
        if self._learning is not None:
            # The learned tilt applies to the other mounting.
            self._learning.forget()
        self._update_learning_mask()

    def exclude(self, weights: NDArray[np.uint8] | None) -> None:
        """
        Continue without the areas that are fixed to the camera; no pair is lost.

        ``weights`` are those of the pixels of the frames in addition to the mask, (H, W), 0 to
        255; None if all count equally.
        """
        self._weights.use(weights)
        self._update_learning_mask()
        if self._meter is not None:
            self._meter.use_mask(self._weights.current)

    def forget_frame(self) -> None:
        """Make the next frame the first of a pair; the heading is kept."""
        if self._meter is not None:
            self._meter.reset()

    def correlation_map(self) -> NDArray[np.float32]:
        """Return the correlation map of the newest pair on the cylinder; (0, 0) at first."""
        if self._meter is None:
            return np.zeros((0, 0), np.float32)
        return self._meter.correlation_map()

    def measure(
        self, frame: NDArray[np.uint8], interval: float, *, speed: float | None = None,
    ) -> YawMeasurement | None:
        """
        Return the yaw measurement of the next frame, None for the first frame of a pair.

        Its shift is that at the centre of the image, in pixels of the full frame. For ``interval``
        and ``speed``, see ``YawMeter.update``.

        Raises
        ------
        FrameError
            The frame cannot be used. The state is unchanged.

        """
        if (self._meter is not None and self.lens.focal_px and frame.shape[1:] != self._shape[1:]):
            raise FrameError(
                f'frames of {frame.shape[1]}x{frame.shape[0]} pixels after frames of'
                f' {self._shape[1]}x{self._shape[0]}, but focal_px is for one size: give hfov_deg'
                ' instead, or use_lens with the focal length for the new size')
        if self._meter is None or frame.shape != self._shape:
            self._meter = self._make_meter(frame, self.lens)
        measurement = self._meter.update(frame, interval, speed=speed)
        if self._learning is not None:
            self._newest_frame = frame
            # Not the shift of the whole image: in a gentle bend, parallax may exceed the yaw.
            seen = None if measurement is None or measurement.is_traffic else measurement
            yaw = None if seen is None else seen.yaw
            self._learned |= self._learning.update(
                frame, 0.0 if yaw is None else self.shift_by(yaw), interval,
                reverses=None if seen is None else seen.reverses)
        if measurement is None:
            return None
        shift = measurement.shift
        return replace(measurement, shift=Shift(
            self.shift_by(shift.dx / self._px_per_rad),
            shift.dy * (self._focal[1] / self._px_per_rad), shift.response))

    def learn(self, stamp_ns: int) -> float | None:
        """
        Use what was learned up to the newest frame, if it is better.

        Return the factor that corrects the angles measured so far; None if the lens stays.
        """
        if self._learning is None:
            return None
        self._learning.add_stamp(stamp_ns)
        return self._adopt(self._learning.lens) if self._learned else None

    def cut(self) -> None:
        """Take the newest frame for the first of a scene: forget the lean, and learn nothing."""
        if self._meter is not None:
            self._meter.roll.forget_lean()
        if self._learning is not None:
            self._learning.cut()

    def finish(self) -> None:
        """Learn from the last frames of the drive."""
        if self._learning is not None:
            self._learning.finish()

    def foresees(self, frame: NDArray[np.uint8], waited: float, interval: float) -> bool:
        """Return whether a frame needs no measurement; see ``YawMeter.foresees``."""
        return (self._meter is not None and frame.shape == self._shape
                and self._meter.foresees(frame, waited, interval))

    @property
    def foreseen_deviation(self) -> float:
        """Return the standard deviation in radians of a change of the heading that is foreseen."""
        return TUNING.foreseen_tolerance_px / 2 / self._px_per_rad / self.tilt

    def shift_by(self, angle: float) -> float:
        """
        Return the shift to the right at the centre of the image, in pixels of the full frame.

        It is that of a turn to the left by this ``angle`` about the vertical axis of the camera,
        in radians, which is limited to what a picture may show.
        """
        return self._focal[0] * math.tan(min(max(angle, -1.5), 1.5))

    def _update_learning_mask(self) -> None:
        if self._learning is not None:
            self._learning.use_mask(self._weights.in_8_bits)

    def _adopt(self, lens: Lens) -> float | None:
        """Continue with the lens learned from the drive, if it differs or is known better."""
        self._learned = False
        assert self._newest_frame is not None and self.in_use is not None
        if self._learning is not None and self._learning.settled:
            self._learning = None
        if self.in_use.settled and lens.is_close_to(self.lens, self._newest_frame.shape[1]):
            return None
        try:
            self._meter = self._make_meter(self._newest_frame, lens)
        except FrameError:
            # The frames cannot be measured with this lens: keep the guess.
            return None
        factor = self._set_lens(lens)
        self._meter.update(self._newest_frame, 0.0)
        return factor

    def _set_lens(self, lens: Lens) -> float:
        """Use another lens; return the factor that corrects angles measured with a guess."""
        before, self.lens = self.lens, lens
        if not self._shape or not before.is_guess:
            return 1.0
        # Not the roll: the current one has been taken into account.
        level_before, level = math.cos(before.horizon.pitch), math.cos(lens.horizon.pitch)
        return level_before / level / lens.focal_ratio(before, self.width)

    def _model_of(self, lens: Lens, shape: tuple[int, ...]) -> CameraModel:
        # Numbers and estimates describe the upright image, calibrations the camera.
        camera = lens.camera_for((shape[0], shape[1]))
        return camera.turned_180() if self.rotate_180 and lens.camera else camera

    def _make_meter(self, frame: NDArray[np.uint8], lens: Lens) -> YawMeter:
        if self._weights.mask is not None:
            check_size(frame, self._weights.mask)
        camera = self._model_of(lens, frame.shape)
        projection = CylinderProjection(camera)
        # Another column of the principal point does not change the pitch.
        before = self._meter if lens.horizon == self.lens.horizon else None
        meter = YawMeter(
            projection, mask=self._weights.mask,
            mounting=Mounting(lens.horizon) if before is None else before.mounting,
            roll=self.roll.with_mounting(lens.horizon) if before is None else before.roll)
        if self._weights.keep_for(frame.shape):
            meter.use_mask(self._weights.current)
        self._focal = (camera.fx, camera.fy)
        self._px_per_rad = projection.px_per_rad
        self._shape = frame.shape
        return meter
