# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Projects latitude and longitude to the plane of a map, in metres, and back."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

# The ellipsoid of WGS 84: semi-major axis in metres, and squared eccentricity.
_A = 6378137.0
_E2 = 6.69437999014e-3


@dataclass(frozen=True, slots=True)
class LocalProjection:
    """
    The tangent plane of the WGS 84 ellipsoid at an origin: x east, y north, in metres (ENU).

    The projection is orthographic: along the normal of the plane. It shrinks lengths by d² / 2R²
    at the distance d: 1 mm per km at 10 km, 13 mm per km at 33 km. The y axis points north at the
    origin. ``to_degrees`` is the exact inverse of ``to_metres`` on the hemisphere of the origin.

    Parameters
    ----------
    latitude, longitude
        The origin, in degrees.

    """

    latitude: float
    longitude: float

    @classmethod
    def around(cls, latitude: ArrayLike, longitude: ArrayLike) -> LocalProjection:
        """Return the projection around the middle of points (N,) in degrees, N at least 1."""
        latitudes, longitudes = np.asarray(latitude), np.asarray(longitude)
        # A map may lie on both sides of the meridian of 180 degrees.
        east = (longitudes - longitudes[0] + 180.0) % 360.0 - 180.0
        middle = longitudes[0] + (east.min() + east.max()) / 2
        return cls(
            float(latitudes.min() + latitudes.max()) / 2,
            float((middle + 180.0) % 360.0 - 180.0))

    def to_metres(self, latitude: ArrayLike, longitude: ArrayLike) -> NDArray[np.float64]:
        """Return x and y, (N, 2) in metres, of points (N,); NaN on the other hemisphere."""
        moved = _earth(latitude, longitude) - self._origin
        east, north, up = self._axes
        plane = np.stack([moved @ east, moved @ north], axis=-1)
        hidden = _normal(latitude, longitude) @ up <= 0.0
        return np.where(hidden[..., None], np.nan, plane)

    def to_degrees(
        self, x: ArrayLike, y: ArrayLike,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return latitude and longitude, (N,) in degrees, of points (N,) in metres."""
        east, north, up = self._axes
        foot = (
            self._origin + np.asarray(x, np.float64)[..., None] * east
            + np.asarray(y, np.float64)[..., None] * north)
        # Intersect the normal with the ellipsoid, stretched to a sphere: a quadratic equation.
        stretch = np.array([1.0, 1.0, 1.0 / math.sqrt(1.0 - _E2)])
        start, along = foot * stretch, up * stretch
        a, b = along @ along, start @ along
        c = (start * start).sum(axis=-1) - _A * _A
        # This form of the root has no cancellation near the origin.
        rise = -c / (b + np.sqrt(b * b - a * c))
        # Contiguous, as in ``lens_family.project``.
        x, y, z = np.ascontiguousarray(np.moveaxis(foot + rise[..., None] * up, -1, 0))
        flat = np.hypot(x, y) * (1.0 - _E2)
        return np.degrees(np.arctan2(z, flat)), np.degrees(np.arctan2(y, x))

    @property
    def _origin(self) -> NDArray[np.float64]:
        return _earth(self.latitude, self.longitude)

    @property
    def _axes(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the unit vectors to the east, to the north and up at the origin."""
        up = _normal(self.latitude, self.longitude)
        longitude = math.radians(self.longitude)
        east = np.array([-math.sin(longitude), math.cos(longitude), 0.0])
        return east, np.cross(up, east), up


def bearing_deg(heading: float) -> float:
    """Return the compass bearing, 0 to 360 degrees, of a heading in radians from east (ENU)."""
    return (90.0 - math.degrees(heading)) % 360.0


def _normal(latitude: ArrayLike, longitude: ArrayLike) -> NDArray[np.float64]:
    """Return the unit normals of the ellipsoid at points in degrees, (N, 3)."""
    lat, lon = np.radians(latitude), np.radians(longitude)
    return np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)


def _earth(latitude: ArrayLike, longitude: ArrayLike) -> NDArray[np.float64]:
    """Return points in degrees as Earth-centred coordinates (ECEF), (N, 3), in metres."""
    up = _normal(latitude, longitude)
    radius = _A / np.sqrt(1.0 - _E2 * up[..., 2] ** 2)
    return np.asarray(radius[..., None] * up * np.array([1.0, 1.0, 1.0 - _E2]), np.float64)
