# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The model of a calibrated camera, which projects directions to pixels.

Axes are those of an optical frame (REP 103): x to the right, y down, z forward. In the image,
columns go to the right and rows down, and the centre of the first pixel is at (0, 0).
"""

from dataclasses import dataclass, replace
from enum import Enum
from functools import lru_cache
import math

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.lens_family import check_focal, OneNumberLens, PINHOLE, radius
from phase_traj_ros.core.camera.tuning import TUNING

# Limit of pixel coordinates, far outside of any calibrated image.
_FAR = 1e6
# Indices of the coefficients (p1, p2, thin prism, tilt) whose sign depends on the orientation of
# the image.
_SIGNED_COEFFICIENTS = (2, 3, 8, 9, 10, 11, 12, 13)

Numbers = NDArray[np.float64]


class Distortion(Enum):
    """Distortion model of a lens; the value describes its coefficients."""

    NONE = 'no coefficients'
    BROWN = '4, 5, 8, 12 or 14 coefficients'
    """OpenCV's polynomial and rational models: k1, k2, p1, p2[, k3[, k4, k5, k6[, ...]]]."""
    FISHEYE = '4 coefficients'
    """OpenCV's fisheye model, equidistant: k1, k2, k3, k4."""
    ONE_NUMBER = '1 coefficient'
    """The lenses of ``lens_family``: the straightness."""


# Allowed numbers of coefficients.
_COEFFICIENT_COUNTS = {
    Distortion.NONE: (0,), Distortion.BROWN: (4, 5, 8, 12, 14), Distortion.FISHEYE: (4,),
    Distortion.ONE_NUMBER: (1,)}


@dataclass(frozen=True, slots=True)
class ImagePoints:
    """
    Positions of directions in an image, in three arrays of one shape.

    A direction that is not ``seen`` has the position of the nearest direction in the range of the
    model.
    """

    columns: Numbers
    rows: Numbers
    seen: NDArray[np.bool_]
    """Whether the direction is inside the image."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraModel:
    """
    A calibrated camera for images of one size.

    Raises
    ------
    ValueError
        A value is out of its range, or the number of coefficients is wrong for the distortion.

    """

    width: int
    """Width of the images in pixels."""
    height: int
    """Height of the images in pixels."""
    fx: float
    """Horizontal focal length in pixels."""
    fy: float
    """Vertical focal length in pixels."""
    cx: float
    """Column of the principal point."""
    cy: float
    """Row of the principal point."""
    distortion: Distortion = Distortion.NONE
    coefficients: tuple[float, ...] = ()
    """Distortion coefficients, in the order of OpenCV."""

    def __post_init__(self) -> None:
        """Check the values."""
        if min(self.shape) < 1:
            raise ValueError(
                f'the calibration is for images of {self.width}x{self.height} pixels: give the'
                ' size of the images it was made with')
        check_focal('fx', self.fx)
        check_focal('fy', self.fy)
        for name, value in (('cx', self.cx), ('cy', self.cy)):
            if not math.isfinite(value):
                raise ValueError(f'{name} is {value}: give a finite number of pixels')
        if len(self.coefficients) not in _COEFFICIENT_COUNTS[self.distortion]:
            raise ValueError(
                f'there are {len(self.coefficients)} distortion coefficients: give'
                f' {self.distortion.value} for {self.distortion.name}')
        if not all(map(math.isfinite, self.coefficients)):
            raise ValueError(
                f'the distortion coefficients are {self.coefficients}: give finite numbers')

    @classmethod
    def pinhole(cls, shape: tuple[int, int], focal_px: float) -> 'CameraModel':
        """
        Return a pinhole camera with a focal length in pixels.

        The images, (H, W), have no distortion and their principal point at the centre.

        Raises
        ------
        ValueError
            The focal length is out of its range, or the image is empty.

        """
        return cls.of_lens(OneNumberLens(focal_px), shape)

    @classmethod
    def of_lens(
        cls, lens: OneNumberLens, shape: tuple[int, int], *, column: float = 0.0,
    ) -> 'CameraModel':
        """
        Return the model of a camera with a lens of ``lens_family``, for images (H, W).

        The principal point is ``column`` pixels to the right of the centre. A lens that is nearly
        a pinhole becomes a pinhole.
        """
        height, width = shape
        pinhole = cls(
            width=width, height=height, fx=lens.focal_px, fy=lens.focal_px,
            cx=(width - 1) / 2 + column, cy=(height - 1) / 2)
        if abs(lens.straightness - PINHOLE) < TUNING.pinhole_tolerance:
            return pinhole
        return replace(
            pinhole, distortion=Distortion.ONE_NUMBER, coefficients=(lens.straightness,))

    @property
    def shape(self) -> tuple[int, int]:
        """Return the size of the images, (H, W)."""
        return self.height, self.width

    @property
    def offset(self) -> float:
        """Return the offset of the principal point to the right of the centre, in image widths."""
        return (self.cx - (self.width - 1) / 2) / self.width

    @property
    def hfov_deg(self) -> float:
        """Return the horizontal field of view in degrees at the principal point; at most 180."""
        return _hfov_deg(self)

    def is_close_to(self, other: 'CameraModel') -> bool:
        """Return whether the difference of the two models has no effect on the yaw."""
        return (
            (self.shape, self.distortion, self.coefficients)
            == (other.shape, other.distortion, other.coefficients)
            and abs(self.fx / other.fx - 1.0) < TUNING.same_focal
            and abs(self.fy / other.fy - 1.0) < TUNING.same_focal
            and abs(self.cx - other.cx) < TUNING.same_centre_px
            and abs(self.cy - other.cy) < TUNING.same_centre_px)

    def turned_180(self) -> 'CameraModel':
        """Return the model of the same camera for images rotated by 180 degrees."""
        coefficients = self.coefficients
        if self.distortion is Distortion.BROWN:
            coefficients = tuple(
                -value if index in _SIGNED_COEFFICIENTS else value
                for index, value in enumerate(coefficients))
        return replace(self, cx=self.width - 1 - self.cx, cy=self.height - 1 - self.cy,
                       coefficients=coefficients)

    def project(self, x: Numbers, y: Numbers, z: Numbers) -> ImagePoints:
        """
        Project directions (x, y, z), arrays that broadcast, to the image.

        Directions behind the camera or outside the image are not seen. A distortion polynomial is
        fitted inside the image. Farther out it may turn back and project outside directions into
        the image. The model is therefore used along each ray from the optical axis only while the
        distance from the principal point increases.
        """
        x, y, z = np.broadcast_arrays(x, y, z)
        ahead = z > 0
        z = np.where(ahead, z, 1 / _FAR)
        x, y = x / z, y / z
        if self.distortion is Distortion.NONE:
            columns, rows, valid = self.cx + self.fx * x, self.cy + self.fy * y, ahead
        else:
            angle, limit = np.arctan(np.hypot(x, y)), self._limit(np.arctan2(y, x))
            valid = ahead & (angle <= limit)
            beyond = np.tan(limit, where=~valid, out=np.ones_like(x))
            beyond /= np.tan(angle, where=~valid, out=np.ones_like(x))
            columns, rows = self._distorted(x * beyond, y * beyond)
        seen = (
            valid & (columns >= -0.5) & (columns <= self.width - 0.5)
            & (rows >= -0.5) & (rows <= self.height - 0.5))
        return ImagePoints(columns, rows, seen)

    def _limit(self, ray: Numbers) -> Numbers:
        """Return the largest angle from the axis, in radians, at which the model is valid."""
        count, steps = TUNING.range_rays, TUNING.range_steps
        angles = np.linspace(0, math.pi / 2, steps, endpoint=False)
        rays = np.linspace(0, 2 * math.pi, count, endpoint=False)
        radius = np.tan(angles)
        columns, rows = self._distorted(
            np.outer(np.cos(rays), radius), np.outer(np.sin(rays), radius))
        distance = np.hypot((columns - self.cx) / self.fx, (rows - self.cy) / self.fy)
        growing = np.diff(distance) > 0
        # The first angle at which the distance stops increasing, else the last angle.
        last = np.where(growing.all(axis=1), steps - 1, growing.argmin(axis=1))
        limits = angles[last]
        # Between two rays, the smaller limit is used.
        index = np.floor(ray / (2 * math.pi) * count).astype(np.intp)
        return np.minimum(limits[index % count], limits[(index + 1) % count])

    def _distorted(self, x: Numbers, y: Numbers) -> tuple[Numbers, Numbers]:
        """Return columns and rows of the directions (x, y, 1), without a check of the range."""
        if self.distortion is Distortion.ONE_NUMBER:
            aside = np.maximum(np.hypot(x, y), 1 / _FAR)
            inwards = radius(np.arctan(aside), *self.coefficients) / aside
            return self.cx + self.fx * x * inwards, self.cy + self.fy * y * inwards
        points = np.stack((x, y, np.ones_like(x)), axis=-1).reshape(-1, 1, 3)
        matrix = np.array(((self.fx, 0, self.cx), (0, self.fy, self.cy), (0, 0, 1)), np.float64)
        project = (
            cv2.fisheye.projectPoints if self.distortion is Distortion.FISHEYE
            else cv2.projectPoints)
        found, _ = project(points, np.zeros(3), np.zeros(3), matrix, np.array(self.coefficients))
        places = np.nan_to_num(np.asarray(found, np.float64), nan=_FAR).reshape(*x.shape, 2)
        places = np.clip(places, -_FAR, _FAR)
        return places[..., 0], places[..., 1]


@lru_cache(maxsize=8)
def _hfov_deg(camera: CameraModel) -> float:
    if camera.distortion is Distortion.NONE:
        return OneNumberLens(camera.fx).hfov_deg(camera.width, column=camera.offset * camera.width)
    angles = np.radians(np.linspace(-90.0, 90.0, TUNING.hfov_steps, endpoint=False)[1:])
    level, ahead = np.zeros_like(angles), np.ones_like(angles)
    seen = angles[camera.project(np.tan(angles), level, ahead).seen]
    return math.degrees(float(np.ptp(seen))) if seen.size else 0.0
