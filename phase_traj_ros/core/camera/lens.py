# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is known of a camera, and from where: numbers, a calibration, the drive, or a guess."""

from dataclasses import dataclass, replace
from enum import Enum
import math

from phase_traj_ros.core.camera.estimate import CameraEstimate
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.lens_family import focal_px_of, OneNumberLens, PINHOLE
from phase_traj_ros.core.camera.model import CameraModel, MOST_FOCAL_PX
from phase_traj_ros.core.camera.projection import (
    focal_from_hfov,
    hfov_from_focal,
    LEAST_HFOV_DEG,
)
from phase_traj_ros.errors import FrameError

MOST_TILT_DEG = 60.0
"""Largest pitch and roll that are accepted, in degrees."""
# Of the focal length of a camera that nothing is known of, as a share of it.
_ASSUMED_DEVIATION = 0.3
# To the last digits of a logarithm.
_HALVINGS = 52
# Lenses that differ by less than this, as shares and in straightness, do not differ.
_SAME_FOCAL, _SAME_STRAIGHTNESS = 0.01, 0.05


class LensOrigin(Enum):
    """Where the knowledge of a camera comes from."""

    GIVEN = 'parameters'
    """Numbers that the user gave."""
    CALIBRATION = 'calibration'
    """A calibration that comes with the images: camera_info or calib.txt."""
    DRIVE = 'drive'
    """Estimated from the turns of the drive."""
    ASSUMED = 'assumed'
    """A usual camera, as long as nothing else is known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lens:
    """
    What is known of the camera: one of the first four is enough, and the first one counts.

    Numbers count before a calibration: a user who gives them has a reason.

    Raises
    ------
    ValueError
        None of the four is given, or a value is out of its range.

    """

    focal_px: float = 0.0
    """Focal length in pixels of the full frame, per radian in its middle; 0 if not known."""
    hfov_deg: float = 0.0
    """Horizontal field of view in degrees, from edge to edge; counts where the above is 0."""
    camera: CameraModel | None = None
    """The calibration, for frames of one size; counts where both of the above are 0."""
    estimate: CameraEstimate | None = None
    """What drives have told."""
    straightness: float = PINHOLE
    """Of the lens, for the first two (see ``OneNumberLens``): 1 for a pinhole."""
    offset: float = 0.0
    """How far the principal point of the upright picture is right of its middle, in widths."""
    pitch_deg: float = 0.0
    """How far the camera looks down, in degrees."""
    roll_deg: float = 0.0
    """How far its right side hangs down, in degrees."""
    assumed: bool = False
    """Whether the numbers are a guess."""

    def __post_init__(self) -> None:
        """Check the values."""
        if not 0.0 <= self.focal_px <= MOST_FOCAL_PX:
            raise ValueError(
                f'focal_px is {self.focal_px}: give a number of pixels, at most'
                f' {MOST_FOCAL_PX:.0e}, or 0')
        if self.hfov_deg != 0.0 and not LEAST_HFOV_DEG <= self.hfov_deg < 180.0:
            raise ValueError(
                f'hfov_deg is {self.hfov_deg}: give degrees from {LEAST_HFOV_DEG} to below 180, or'
                ' 0')
        if (self.focal_px == 0.0 and self.hfov_deg == 0.0 and self.camera is None
                and self.estimate is None):
            raise ValueError(
                'neither focal_px nor hfov_deg nor a calibration of the camera is known: give one'
                ' of them')
        for name, angle in (('pitch_deg', self.pitch_deg), ('roll_deg', self.roll_deg)):
            if not abs(angle) <= MOST_TILT_DEG:
                raise ValueError(
                    f'{name} is {angle}: give degrees from -{MOST_TILT_DEG:g} to'
                    f' {MOST_TILT_DEG:g}')
        if not abs(self.offset) <= 0.5:
            raise ValueError(f'offset is {self.offset}: give a share of the width, -0.5 to 0.5')
        OneNumberLens(1.0, self.straightness)
        most = 180.0 / math.sqrt(max(self.straightness, PINHOLE))
        if self.hfov_deg >= most:
            raise ValueError(
                f'hfov_deg is {self.hfov_deg}: a lens of the straightness {self.straightness} sees'
                f' less than {most:.0f} degrees')

    @property
    def origin(self) -> LensOrigin:
        """Return where the knowledge comes from."""
        if self.assumed:
            return LensOrigin.ASSUMED
        if self.focal_px or self.hfov_deg:
            return LensOrigin.GIVEN
        return LensOrigin.DRIVE if self.camera is None else LensOrigin.CALIBRATION

    @property
    def calibrated(self) -> bool:
        """Return whether it is the calibration that counts."""
        return self.origin is LensOrigin.CALIBRATION

    @property
    def horizon(self) -> Horizon:
        """Return what is known of the camera's tilt against the road."""
        if self.origin is LensOrigin.DRIVE and self.estimate is not None:
            return self.estimate.horizon
        given = Horizon(math.radians(self.pitch_deg), math.radians(self.roll_deg))
        return replace(given, roll_deviation=0.0) if self.roll_deg else given

    @property
    def pitch_known(self) -> bool:
        """Return whether the pitch was given; 0 stands for a pitch that is not known."""
        return self.pitch_deg != 0.0 and self.origin is not LensOrigin.DRIVE

    @property
    def focal_deviation(self) -> float:
        """Return the standard deviation of the focal length as a share of it, if there is any."""
        if self.origin is LensOrigin.ASSUMED:
            return _ASSUMED_DEVIATION
        if self.origin is LensOrigin.DRIVE and self.estimate is not None:
            return self.estimate.focal_deviation
        return 0.0

    @property
    def tilt(self) -> float:
        """
        Return the cosine of the angle between the picture's vertical axis and the true one.

        A camera that is tilted sees only this share of a turn as yaw.
        """
        pitch, roll = self.pitch_deg, self.roll_deg
        if self.origin is LensOrigin.DRIVE and self.estimate is not None:
            pitch, roll = self.estimate.pitch_deg, self.estimate.roll_deg
        return math.cos(math.radians(pitch)) * math.cos(math.radians(roll))

    def focal_for(self, width: int) -> float:
        """Return the (horizontal) focal length in pixels for frames ``width`` pixels wide."""
        if self.focal_px:
            return self.focal_px
        if self.hfov_deg and self.offset:
            return self._focal_aside(width)
        if self.hfov_deg and self.straightness == PINHOLE and self.offset == 0.0:
            return focal_from_hfov(self.hfov_deg, width)
        if self.hfov_deg:
            return focal_px_of(
                self.hfov_deg, width, self.straightness, column=self.offset * width)
        if self.camera is not None:
            return self.camera.fx
        assert self.estimate is not None
        return self.estimate.focal_px * width / self.estimate.width

    def hfov_for(self, width: int) -> float:
        """Return the horizontal field of view in degrees for frames ``width`` pixels wide."""
        if self.calibrated and self.camera is not None:
            return self.camera.hfov_deg
        if self._straightness == PINHOLE and self._offset == 0.0:
            return hfov_from_focal(self.focal_for(width), width)
        lens = OneNumberLens(self.focal_for(width), self._straightness)
        return lens.hfov_deg(width, column=self._offset * width)

    def is_close_to(self, other: 'Lens', width: int) -> bool:
        """Return whether another lens makes no difference to speak of for frames that wide."""
        return (
            abs(math.log(self.focal_for(width) / other.focal_for(width))) < _SAME_FOCAL
            and abs(self._straightness - other._straightness) < _SAME_STRAIGHTNESS
            and abs(self._offset - other._offset) < _SAME_FOCAL
            and abs(self.tilt / other.tilt - 1.0) < _SAME_FOCAL)

    def camera_for(self, shape: tuple[int, int]) -> CameraModel:
        """
        Return the model of the camera for frames of this shape, (H, W).

        Raises
        ------
        FrameError
            The calibration counts, and is for pictures of another size.

        """
        if not self.calibrated or self.camera is None:
            return OneNumberLens(self.focal_for(shape[1]), self._straightness).model(
                shape, column=self._offset * shape[1])
        if shape != self.camera.shape:
            raise FrameError(
                f'frames of {shape[1]}x{shape[0]} pixels, but the calibration of the camera is for'
                f' {self.camera.width}x{self.camera.height}: publish the camera_info that belongs'
                ' to the images, or give focal_px')
        return self.camera

    def _focal_aside(self, width: int) -> float:
        """Return the focal length with which the edges are ``hfov_deg`` apart, off the middle."""
        low, high = math.log(1e-3 * width), math.log(min(1e4 * width, MOST_FOCAL_PX))
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            lens = OneNumberLens(math.exp(middle), self.straightness)
            if lens.hfov_deg(width, column=self.offset * width) > self.hfov_deg:
                low = middle
            else:
                high = middle
        return math.exp(high)

    @property
    def _straightness(self) -> float:
        if self.origin is LensOrigin.DRIVE and self.estimate is not None:
            return self.estimate.straightness
        return self.straightness

    @property
    def _offset(self) -> float:
        if self.origin is LensOrigin.DRIVE and self.estimate is not None:
            return self.estimate.column_px / self.estimate.width
        return self.offset
