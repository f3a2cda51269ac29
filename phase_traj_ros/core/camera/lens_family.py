# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A family of lenses from the pinhole to strong fisheyes, with one parameter.

A direction at the angle a from the optical axis is imaged at the distance

    r = f tan(sqrt(k) a) / sqrt(k)

from the principal point. For k = 0 this is f a, for k < 0 it is f tanh(sqrt(-k) a) / sqrt(-k). f
is the focal length in pixels per radian at the principal point; k is the straightness. k is 1 for
a pinhole, 1/4 for a stereographic fisheye, 0 for an equidistant one, and about -1/8 for an
equisolid one. The family is continuous in k: r / f = a + k a^3 / 3 + ...
"""

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

PINHOLE = 1.0
"""Straightness of a pinhole, which keeps straight lines straight."""
STRAIGHTNESS_RANGE = (-1.0, 1.3)
"""Range of the straightness, a little beyond the strongest fisheyes and the pinhole."""
MAX_FOCAL_PX = 1e9
"""Largest focal length in pixels, far above that of any lens; larger values would overflow."""

# Below this straightness, the series is exact to rounding.
_MIN_STRAIGHTNESS = 1e-6
# Largest argument of the tangent; directions farther from the axis are clipped.
_MAX_TANGENT_ANGLE = 1.55


def check_focal(name: str, focal_px: float) -> None:
    """Raise a ValueError that names a focal length in pixels, if no lens can have it."""
    if not 0.0 < focal_px <= MAX_FOCAL_PX:
        raise ValueError(
            f'{name} is {focal_px}: give a number of pixels above 0, at most {MAX_FOCAL_PX:.0e}')


def radius(angle: Numbers, straightness: float) -> Numbers:
    """Return r / f at each angle from the optical axis in radians."""
    root = math.sqrt(abs(straightness))
    if root * root < _MIN_STRAIGHTNESS:
        return angle + straightness * angle ** 3 / 3.0
    if straightness > 0.0:
        return np.asarray(np.tan(np.minimum(root * angle, _MAX_TANGENT_ANGLE)) / root, np.float64)
    return np.asarray(np.tanh(root * angle) / root, np.float64)


def angle_at(distance: Numbers, straightness: float) -> Numbers:
    """Return the angle from the optical axis in radians at each r / f; inverse of ``radius``."""
    root = math.sqrt(abs(straightness))
    if root * root < _MIN_STRAIGHTNESS:
        return distance - straightness * distance ** 3 / 3.0
    if straightness > 0.0:
        return np.asarray(np.arctan(root * distance) / root, np.float64)
    return np.asarray(np.arctanh(np.minimum(root * distance, 0.999)) / root, np.float64)


def unproject(places: Numbers, focal_px: float, straightness: float) -> Numbers:
    """Return the unit vectors (N, 3) of positions (N, 2) in pixels from the principal point."""
    distance = np.hypot(places[:, 0], places[:, 1]) / focal_px
    angle = angle_at(distance, straightness)
    scale = np.where(distance > 1e-9, np.sin(angle) / np.maximum(distance, 1e-12), 1.0) / focal_px
    found = np.empty((len(places), 3))
    found[:, :2], found[:, 2] = places * scale[:, None], np.cos(angle)
    return found


def project(directions: Numbers, focal_px: float, straightness: float) -> Numbers:
    """Return the positions (N, 2) of directions (N, 3), in pixels from the principal point."""
    return directions[:, :2] * (focal_px * _scales(directions, straightness)[-1])[:, None]


def projection_jacobians(directions: Numbers, focal_px: float, straightness: float) -> Numbers:
    """Return the derivatives (N, 2, 3) of ``project``."""
    x, y, z, aside, seen, across = _scales(directions, straightness)
    outwards = np.maximum(aside, 1e-9)
    # dr/da = 1 + k r^2, for any k.
    steep = (1.0 + straightness * seen * seen) / (aside * aside + z * z)
    # On the axis, any direction away from it will do, as the two slopes are equal.
    off_axis, along = aside > 1e-9, steep * z
    ux, uy = np.where(off_axis, x / outwards, 1.0), np.where(off_axis, y / outwards, 0.0)
    change = np.empty((len(directions), 2, 3))
    change[:, 0, 0] = ux * ux * along + uy * uy * across
    change[:, 1, 1] = uy * uy * along + ux * ux * across
    change[:, 0, 1] = change[:, 1, 0] = ux * uy * (along - across)
    change[:, 0, 2], change[:, 1, 2] = -ux * steep * aside, -uy * steep * aside
    return focal_px * change


def _scales(directions: Numbers, straightness: float) -> tuple[Numbers, ...]:
    """Return x, y, z, distance from the axis, r / f, and the ratio of these two, (N,) each."""
    # Contiguous, as for numpy 1 a column overlaps a result that begins where the rows end in
    # memory; it then takes other loops, which round differently.
    x, y, z = np.ascontiguousarray(directions.T)
    aside = np.hypot(x, y)
    seen = radius(np.arctan2(aside, z), straightness)
    across = np.where(aside > 1e-9, seen / np.maximum(aside, 1e-9), 1.0 / np.maximum(z, 1e-9))
    return x, y, z, aside, seen, across


def focal_px_of(hfov_deg: float, width: int, straightness: float, *, column: float) -> float:
    """
    Return the focal length in pixels that gives a field of view, from edge to edge.

    ``column`` is the column of the principal point, in pixels to the right of the centre of an
    image ``width`` pixels wide. This is the inverse of ``OneNumberLens.hfov_deg``.
    """
    angle, sides = math.radians(hfov_deg), width * width / 4 - column * column
    root = math.sqrt(abs(straightness))
    if root * root < _MIN_STRAIGHTNESS:
        return width / angle
    # Sum of the angles of both sides, by the addition theorem of tan or tanh.
    tangent = math.tan(root * angle) if straightness > 0.0 else math.tanh(root * angle)
    under = width * width + math.copysign(4.0, straightness) * tangent * tangent * sides
    return root * (width + math.copysign(math.sqrt(max(under, 0.0)), tangent)) / (2.0 * tangent)


@dataclass(frozen=True, slots=True)
class OneNumberLens:
    """
    A lens of this family, for images of any size.

    Raises
    ------
    ValueError
        A number is out of its range.

    """

    focal_px: float
    """Focal length in pixels per radian at the principal point."""
    straightness: float = PINHOLE

    def __post_init__(self) -> None:
        """Check the values."""
        check_focal('focal_px', self.focal_px)
        least, most = STRAIGHTNESS_RANGE
        if not least <= self.straightness <= most:
            raise ValueError(
                f'straightness is {self.straightness}: give a number from {least} to {most}, 1 for'
                ' a pinhole')

    def hfov_deg(self, width: int, *, column: float = 0.0) -> float:
        """
        Return the horizontal field of view of an image in degrees, from edge to edge.

        ``column`` is the column of the principal point, in pixels to the right of the centre.
        """
        edges = np.array([width / 2 - column, width / 2 + column]) / self.focal_px
        angles = np.sign(edges) * angle_at(np.abs(edges), self.straightness)
        return min(math.degrees(float(angles.sum())), 360.0)
