# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where a camera sees a direction, according to its calibration.

Axes are those of an optical frame (REP 103): x to the right, y down, z forward. In the picture,
columns go to the right and rows down, the centre of the first pixel is at (0, 0).
"""

from dataclasses import dataclass, replace
from enum import Enum
from functools import lru_cache
import math

import cv2
import numpy as np
from numpy.typing import NDArray

# The rays from the optical axis along which a model is followed, and the steps on each, to 90
# degrees: 0.18 degrees, of which the last one that is sound counts.
_RAYS, _STEPS = 72, 500
# The field of view is told to a tenth of a degree.
_ACROSS = 1800
# Nobody has calibrated a camera to see as far as this, but a model may say so; in pixels.
_FAR = 1e6
# Of these coefficients (p1, p2, the thin prism's and the tilt's) the sign depends on which way up
# the picture is.
_DIRECTED = (2, 3, 8, 9, 10, 11, 12, 13)

MOST_FOCAL_PX = 1e9
"""No lens has a longer focal length, in pixels; much longer ones would overflow."""

Numbers = NDArray[np.float64]
# Calibrations that follow the autofocus tremble: a share of the focal length, and pixels.
_SAME_FOCAL, _SAME_CENTRE = 0.001, 0.25


class Distortion(Enum):
    """How a lens departs from a pinhole; the value says which coefficients it takes."""

    NONE = 'no coefficients'
    BROWN = '4, 5, 8, 12 or 14 coefficients'
    """OpenCV's polynomial and rational models: k1, k2, p1, p2[, k3[, k4, k5, k6[, ...]]]."""
    FISHEYE = '4 coefficients'
    """OpenCV's fisheye model, equidistant: k1, k2, k3, k4."""

    @property
    def counts(self) -> tuple[int, ...]:
        """Return how many coefficients there may be."""
        return _COUNTS[self]


_COUNTS = {
    Distortion.NONE: (0,), Distortion.BROWN: (4, 5, 8, 12, 14), Distortion.FISHEYE: (4,)}


@dataclass(frozen=True, slots=True)
class Sight:
    """
    Where directions are in a picture; three arrays of one shape.

    A direction that is not ``seen`` has a position as well: that of the direction nearest to it
    that the model holds for.
    """

    columns: Numbers
    rows: Numbers
    seen: NDArray[np.bool_]
    """Whether the picture shows it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraModel:
    """
    A calibrated camera, for pictures of one size.

    Raises
    ------
    ValueError
        A value is out of its range, or the coefficients are not as many as the distortion takes.

    """

    width: int
    """Columns of the pictures that the calibration is for."""
    height: int
    """Rows."""
    fx: float
    """Focal length in pixels, horizontally."""
    fy: float
    """Vertically."""
    cx: float
    """Column of the principal point."""
    cy: float
    """Row of the principal point."""
    distortion: Distortion = Distortion.NONE
    coefficients: tuple[float, ...] = ()
    """Of the distortion, in OpenCV's order."""

    def __post_init__(self) -> None:
        """Check the values."""
        if self.width < 1 or self.height < 1:
            raise ValueError(
                f'the calibration is for pictures of {self.width}x{self.height} pixels: give the'
                ' size of the pictures it was made with')
        for name, value in (('fx', self.fx), ('fy', self.fy)):
            if not 0 < value <= MOST_FOCAL_PX:
                raise ValueError(
                    f'{name} is {value}: give a number of pixels above 0, at most'
                    f' {MOST_FOCAL_PX:.0e}')
        for name, value in (('cx', self.cx), ('cy', self.cy)):
            if not math.isfinite(value):
                raise ValueError(f'{name} is {value}: give a finite number of pixels')
        if len(self.coefficients) not in self.distortion.counts:
            raise ValueError(
                f'there are {len(self.coefficients)} distortion coefficients: give'
                f' {self.distortion.value} for {self.distortion.name}')
        if not all(map(math.isfinite, self.coefficients)):
            raise ValueError(
                f'the distortion coefficients are {self.coefficients}: give finite numbers')

    @classmethod
    def pinhole(cls, shape: tuple[int, int], focal_px: float) -> 'CameraModel':
        """
        Return a camera of which the focal length in pixels is all that is known.

        The pictures, (H, W), have no distortion and their principal point in the middle.

        Raises
        ------
        ValueError
            The focal length is out of its range, or the picture is empty.

        """
        if not 0 < focal_px <= MOST_FOCAL_PX:
            raise ValueError(
                f'focal_px is {focal_px}: give a number of pixels above 0, at most'
                f' {MOST_FOCAL_PX:.0e}')
        height, width = shape
        return cls(width=width, height=height, fx=focal_px, fy=focal_px,
                   cx=(width - 1) / 2, cy=(height - 1) / 2)

    @property
    def shape(self) -> tuple[int, int]:
        """Return the size of the pictures, (H, W)."""
        return self.height, self.width

    @property
    def offset(self) -> float:
        """Return how far the principal point is to the right of the middle, in widths."""
        return (self.cx - (self.width - 1) / 2) / self.width

    @property
    def hfov_deg(self) -> float:
        """Return the field of view across, in the row of the principal point; at most 180."""
        return _degrees_across(self)

    def is_close_to(self, other: 'CameraModel') -> bool:
        """Return whether the two differ by no more than what makes no difference to the yaw."""
        alike = (
            (self.shape, self.distortion, self.coefficients)
            == (other.shape, other.distortion, other.coefficients))
        return (
            alike and abs(self.fx / other.fx - 1.0) < _SAME_FOCAL
            and abs(self.fy / other.fy - 1.0) < _SAME_FOCAL
            and abs(self.cx - other.cx) < _SAME_CENTRE and abs(self.cy - other.cy) < _SAME_CENTRE)

    def turned_180(self) -> 'CameraModel':
        """Return the model of the same camera for its pictures turned by 180 degrees."""
        coefficients = self.coefficients
        if self.distortion is Distortion.BROWN:
            coefficients = tuple(
                -value if index in _DIRECTED else value
                for index, value in enumerate(coefficients))
        return replace(self, cx=self.width - 1 - self.cx, cy=self.height - 1 - self.cy,
                       coefficients=coefficients)

    def project(self, x: Numbers, y: Numbers, z: Numbers) -> Sight:
        """
        Return where the picture shows the directions (x, y, z), in arrays that broadcast.

        What is behind the camera is not seen, nor is what is outside the picture. A polynomial
        fits the picture it was calibrated with; farther out it may turn back, and say that things
        far outside are inside. So along each ray from the optical axis, the model is believed as
        far as the distance from the principal point grows.
        """
        x, y, z = np.broadcast_arrays(x, y, z)
        ahead = z > 0
        z = np.where(ahead, z, 1 / _FAR)
        x, y = x / z, y / z
        if self.distortion is Distortion.NONE:
            columns, rows, sound = self.cx + self.fx * x, self.cy + self.fy * y, ahead
        else:
            angle, limit = np.arctan(np.hypot(x, y)), self._limit(np.arctan2(y, x))
            sound = ahead & (angle <= limit)
            beyond = np.tan(limit, where=~sound, out=np.ones_like(x))
            beyond /= np.tan(angle, where=~sound, out=np.ones_like(x))
            columns, rows = self._distorted(x * beyond, y * beyond)
        seen = (
            sound & (columns >= -0.5) & (columns <= self.width - 0.5)
            & (rows >= -0.5) & (rows <= self.height - 0.5))
        return Sight(columns, rows, seen)

    def _limit(self, ray: Numbers) -> Numbers:
        """Return up to which angle from the axis the model holds, along rays of a direction."""
        angles = np.linspace(0, math.pi / 2, _STEPS, endpoint=False)
        rays = np.linspace(0, 2 * math.pi, _RAYS, endpoint=False)
        radius = np.tan(angles)
        columns, rows = self._distorted(
            np.outer(np.cos(rays), radius), np.outer(np.sin(rays), radius))
        distance = np.hypot((columns - self.cx) / self.fx, (rows - self.cy) / self.fy)
        growing = np.diff(distance) > 0
        # Where it stops growing first; at the last of the angles, if it never does.
        last = np.where(growing.all(axis=1), _STEPS - 1, growing.argmin(axis=1))
        limits = angles[last]
        # Between two rays, the nearer end counts.
        index = np.floor(ray / (2 * math.pi) * _RAYS).astype(np.intp)
        return np.minimum(limits[index % _RAYS], limits[(index + 1) % _RAYS])

    def _distorted(self, x: Numbers, y: Numbers) -> tuple[Numbers, Numbers]:
        """Return columns and rows of the directions (x, y, 1), wherever the model puts them."""
        points = np.stack((x, y, np.ones_like(x)), axis=-1).reshape(-1, 1, 3)
        matrix = np.array(((self.fx, 0, self.cx), (0, self.fy, self.cy), (0, 0, 1)), np.float64)
        project = (
            cv2.fisheye.projectPoints if self.distortion is Distortion.FISHEYE
            else cv2.projectPoints)
        found, _ = project(
            points, np.zeros(3), np.zeros(3), matrix, np.array(self.coefficients))
        places = np.nan_to_num(np.asarray(found, np.float64), nan=_FAR).reshape(*x.shape, 2)
        places = np.clip(places, -_FAR, _FAR)
        return places[..., 0], places[..., 1]


@lru_cache(maxsize=8)
def _degrees_across(camera: CameraModel) -> float:
    if camera.distortion is Distortion.NONE:
        aside = (camera.cx + 0.5, camera.width - 0.5 - camera.cx)
        return math.degrees(sum(math.atan(each / camera.fx) for each in aside))
    angles = np.radians(np.linspace(-90.0, 90.0, _ACROSS, endpoint=False)[1:])
    row = np.full_like(angles, 0.0)
    seen = angles[camera.project(np.tan(angles), row, row + 1.0).seen]
    return math.degrees(float(np.ptp(seen))) if seen.size else 0.0
