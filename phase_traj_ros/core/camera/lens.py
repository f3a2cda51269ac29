# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The lens of a camera: from parameters, a calibration, the drive, or a guess."""

from dataclasses import dataclass, field, replace
from enum import Enum
import math

from phase_traj_ros.core.camera.estimate import CameraEstimate
from phase_traj_ros.core.camera.horizon import Horizon
from phase_traj_ros.core.camera.lens_family import focal_px_of, OneNumberLens, PINHOLE
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.camera.projection import MIN_HFOV_DEG
from phase_traj_ros.core.camera.tuning import TUNING
from phase_traj_ros.errors import FrameError

MAX_TILT_DEG = 60.0
"""Largest pitch and roll that are accepted, in degrees."""
ASSUMED_HFOV_DEG = 75.0
"""Assumed horizontal field of view of an unknown camera, in degrees."""
# Smallest focal length in image widths, where no lens has the given field of view.
_LEAST_FOCAL = 1e-3


def check_tilt(name: str, angle: float) -> None:
    """Raise a ``ValueError`` that names the value if a pitch or roll is out of its range."""
    if not abs(angle) <= MAX_TILT_DEG:
        raise ValueError(
            f'{name} is {angle}: give degrees from -{MAX_TILT_DEG:g} to {MAX_TILT_DEG:g}')


class LensOrigin(Enum):
    """Origin of a lens."""

    GIVEN = 'parameters'
    """Parameters set by the user."""
    CALIBRATION = 'calibration'
    """A calibration that comes with the images: camera_info or calib.txt."""
    DRIVE = 'drive'
    """Learned from the turns of the drive."""
    ASSUMED = 'assumed'
    """A typical camera, until a better one is known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lens:
    """
    The lens of a camera, from one of the first four fields. The first one given is used.

    Parameters of the user take precedence over a calibration. Sources that are not used become 0
    or None, and the other fields are those of an estimate that is used. What the lens gives, its
    focal length, mounting and uncertainty, is determined once.

    Raises
    ------
    ValueError
        None of the four is given, or a value is out of its range.

    """

    focal_px: float = 0.0
    """Focal length in pixels of the full frame, per radian at its centre; 0 if unknown."""
    hfov_deg: float = 0.0
    """Horizontal field of view in degrees, from edge to edge; used if ``focal_px`` is 0."""
    camera: CameraModel | None = None
    """Calibration for frames of one size; used if both values above are 0."""
    estimate: CameraEstimate | None = None
    """Estimate from drives."""
    straightness: float = PINHOLE
    """Straightness for the first two fields (see ``OneNumberLens``): 1 for a pinhole."""
    offset: float = 0.0
    """Offset of the principal point to the right of the upright image centre, in image widths."""
    pitch_deg: float = 0.0
    """Pitch in degrees, positive down; 0 if unknown. The drive improves it."""
    roll_deg: float = 0.0
    """Roll in degrees, positive right side down; 0 if unknown. The drive improves it."""
    assumed: bool = False
    """Whether the values are a guess."""
    origin: LensOrigin = field(init=False, compare=False)
    """Origin of the values."""
    horizon: Horizon = field(init=False, compare=False)
    """Tilt of the camera relative to the road."""
    focal_deviation: float = field(init=False, compare=False, default=0.0)
    """Relative standard deviation of the focal length; 0 if it is given."""
    # The horizontal focal length in pixels, or, if that is 0, in image widths.
    _focal: float = field(init=False, compare=False, repr=False, default=0.0)
    _focal_widths: float = field(init=False, compare=False, repr=False, default=0.0)

    def __post_init__(self) -> None:
        """Check the values, and determine what the source that is used gives."""
        if self.focal_px or self.hfov_deg:
            self._set(origin=LensOrigin.GIVEN, camera=None, estimate=None)
        elif self.camera is not None:
            self._set(origin=LensOrigin.CALIBRATION, estimate=None, _focal=self.camera.fx)
        elif self.estimate is not None:
            estimate = self.estimate
            # It has been checked.
            self._set(
                origin=LensOrigin.DRIVE, straightness=estimate.straightness,
                pitch_deg=estimate.pitch_deg, roll_deg=estimate.roll_deg,
                offset=estimate.column_px / estimate.width, horizon=estimate.horizon,
                focal_deviation=estimate.focal_deviation,
                _focal_widths=estimate.focal_px / estimate.width)
            return
        else:
            raise ValueError(
                'neither focal_px nor hfov_deg nor a calibration of the camera is given: give one'
                ' of them')
        check_tilt('pitch_deg', self.pitch_deg)
        check_tilt('roll_deg', self.roll_deg)
        if not abs(self.offset) <= 0.5:
            raise ValueError(f'offset is {self.offset}: give a share of the width, -0.5 to 0.5')
        OneNumberLens(self.focal_px or 1.0, self.straightness)
        most = 180.0 / math.sqrt(max(self.straightness, PINHOLE))
        if self.hfov_deg != 0.0 and not MIN_HFOV_DEG <= self.hfov_deg < most:
            raise ValueError(
                f'hfov_deg is {self.hfov_deg}: with a straightness of {self.straightness:g}, give'
                f' degrees from {MIN_HFOV_DEG} to less than {most:.0f} degrees, or 0')
        if self.focal_px:
            self._set(_focal=self.focal_px, hfov_deg=0.0)
        elif self.hfov_deg:
            self._set(_focal_widths=max(_LEAST_FOCAL, focal_px_of(
                self.hfov_deg, 1, self.straightness, column=self.offset)))
        self._set(horizon=Horizon().with_given(pitch_deg=self.pitch_deg, roll_deg=self.roll_deg))
        if self.assumed:
            self._set(origin=LensOrigin.ASSUMED, focal_deviation=TUNING.assumed_deviation)

    def _set(self, **values: object) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def tilt(self) -> float:
        """
        Return the cosine of the angle between the vertical image axis and the vertical.

        A tilted camera measures only this fraction of a turn as yaw.
        """
        return math.cos(math.radians(self.pitch_deg)) * math.cos(math.radians(self.roll_deg))

    def focal_for(self, width: int) -> float:
        """Return the horizontal focal length in pixels for frames ``width`` pixels wide."""
        return self._focal or self._focal_widths * width

    @property
    def is_guess(self) -> bool:
        """Return whether the lens is assumed, or learned from the drive."""
        return self.origin in (LensOrigin.ASSUMED, LensOrigin.DRIVE)

    def focal_ratio(self, before: 'Lens', width: int) -> float:
        """
        Return the ratio of the focal length to that of ``before``; 1 if that was not a guess.

        The frames so far are ``width`` pixels wide; a calibration may be for other ones. Distances
        on the road are as many times as long, as the horizon stays in its place.
        """
        if not before.is_guess:
            return 1.0
        own = width if self.camera is None else self.camera.width
        return self.focal_for(own) / own * width / before.focal_for(width)

    def hfov_for(self, width: int) -> float:
        """Return the horizontal field of view in degrees for frames ``width`` pixels wide."""
        if self.camera is not None:
            return self.camera.hfov_deg
        if self.hfov_deg:
            return self.hfov_deg
        lens = OneNumberLens(self.focal_for(width), self.straightness)
        return lens.hfov_deg(width, column=self.offset * width)

    def is_close_to(self, other: 'Lens', width: int) -> bool:
        """Return whether another lens is nearly equal for frames ``width`` pixels wide."""
        offset = TUNING.same_offset if self.origin is LensOrigin.GIVEN else TUNING.same_lens
        return (
            abs(math.log(self.focal_for(width) / other.focal_for(width))) < TUNING.same_lens
            and abs(self.straightness - other.straightness) < TUNING.same_straightness
            and abs(self.offset - other.offset) < offset
            and abs(self.tilt / other.tilt - 1.0) < TUNING.same_lens)

    def turned_180(self) -> 'Lens':
        """Return the lens in upright images, if it was learned from images upside down."""
        if self.estimate is None:
            return replace(self, offset=-self.offset)
        return Lens(estimate=replace(
            self.estimate, column_px=-self.estimate.column_px, pitch_deg=-self.estimate.pitch_deg))

    def camera_for(self, shape: tuple[int, int]) -> CameraModel:
        """
        Return the model of the camera for frames of this shape, (H, W).

        Raises
        ------
        FrameError
            The calibration is used, and is for images of another size.

        """
        if self.camera is None:
            return CameraModel.of_lens(
                OneNumberLens(self.focal_for(shape[1]), self.straightness), shape,
                column=self.offset * shape[1])
        if shape != self.camera.shape:
            raise FrameError(
                f'frames of {shape[1]}x{shape[0]} pixels, but the calibration of the camera is for'
                f' {self.camera.width}x{self.camera.height}: publish the camera_info that belongs'
                ' to the images, or give focal_px')
        return self.camera
