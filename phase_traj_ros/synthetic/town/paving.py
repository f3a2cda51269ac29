# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Paints the map of the ground: grass, pavements, carriageways, markings, shadows."""

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt
from phase_traj_ros.synthetic.arrays import as_bytes, Bytes, Floats
from phase_traj_ros.synthetic.scene.ground import Ground, pyramid
from phase_traj_ros.synthetic.textures.noise import spectral_noise
from phase_traj_ros.synthetic.town.buildings import ROADWAY
from phase_traj_ros.synthetic.town.streets import HALF_WIDTH, Street

#: Pixels per metre, and the largest number of pixels of a map.
_DENSITY = 9.0
_LARGEST = 24e6
_MARGIN = 30.0
_TILE = 1024
_GRAIN_DENSITY = 44.0
#: Drawing coordinates have 4 fractional bits.
_SHIFT = 4


class _Map:
    """A map of all streets. It draws lines and areas given in metres."""

    def __init__(self, streets: Sequence[Street]) -> None:
        points = np.concatenate([street.line for street in streets])
        self.origin = points.min(axis=0) - _MARGIN
        size = points.max(axis=0) + _MARGIN - self.origin
        self.density = min(_DENSITY, float(np.sqrt(_LARGEST / (size[0] * size[1]))))
        (self.width, self.height) = np.ceil(size * self.density).astype(int).tolist()

    def blank(self, tone: int) -> Bytes:
        return np.full((self.height, self.width), tone, np.uint8)

    def pixels(self, points: Floats) -> npt.NDArray[np.int32]:
        """Return drawing coordinates, in fractions of a pixel."""
        place = (points - self.origin) * self.density - 0.5
        pixels: npt.NDArray[np.int32] = np.round(place * 2 ** _SHIFT).astype(np.int32)
        return pixels

    def line(self, picture: Bytes, points: Floats, width: float, tone: float) -> None:
        cv2.polylines(
            picture, [self.pixels(points)], False, tone, max(round(width * self.density), 1),
            cv2.LINE_8, _SHIFT)

    def area(self, picture: Bytes, points: Floats, tone: float) -> None:
        cv2.fillPoly(picture, [self.pixels(points)], tone, cv2.LINE_8, _SHIFT)


def _tile(rng: np.random.Generator, *, slope: float, contrast: float) -> Bytes:
    """Return a periodic tile with variations around 128."""
    noise = spectral_noise(rng, _TILE, _TILE, slope=slope)
    tile: Bytes = np.clip(128.0 * (1.0 + contrast * noise), 20, 255).astype(np.uint8)
    return tile


def _mend(rng: np.random.Generator, area: _Map, picture: Bytes, street: Street) -> None:
    """Draw patches, sealed cracks and the centre marking of the carriageway."""
    total = street.lengths[-1]
    for _ in range(int(total / 9)):
        (along, left) = (rng.uniform(0, total), rng.uniform(-ROADWAY + 0.6, ROADWAY - 0.6))
        (length, width) = rng.uniform((0.4, 0.4), (5.0, 1.8))
        area.line(picture, street.beside(np.array([along, along + length]), left), width,
                  rng.uniform(55, 115))
    for _ in range(int(total / 12)):
        along = rng.uniform(0, total) + np.arange(0.0, rng.uniform(3.0, 25.0), 0.7)
        wander = np.cumsum(rng.normal(0.0, 0.06, len(along)))
        left = rng.uniform(-3.6, 3.6)
        crack = street.beside(along, left + np.clip(wander, -0.6, 0.6))
        area.line(picture, crack, 0.05, rng.uniform(30, 60))
    for along in np.arange(0.0, total, 7.0):
        area.line(picture, street.beside(np.linspace(along, along + 3.0, 4), 1.7), 0.13, 205)


def _shade(area: _Map, shadows: Sequence[Floats]) -> Bytes:
    """Return the light at each place, 128 in full sun."""
    light = area.blank(128)
    for shadow in shadows:
        area.area(light, shadow, 55)
    return as_bytes(cv2.GaussianBlur(light, (3, 3), 0.8))


def pave(rng: np.random.Generator, streets: Sequence[Street], shadows: Sequence[Floats]) -> Ground:
    """Return the ground of the streets, with these shadows, (K, 2) each."""
    area = _Map(streets)
    picture = area.blank(88)
    for street in streets:
        area.line(picture, street.line, 2 * HALF_WIDTH + 1.0, rng.uniform(115, 150))
    for street in streets:
        area.line(picture, street.line, 2 * ROADWAY, 175)
    roads = [rng.uniform(78, 108) for _ in streets]
    for (street, tone) in zip(streets, roads):
        area.line(picture, street.line, 2 * ROADWAY - 0.35, tone)
    for street in (street for street in streets if not street.again):
        _mend(rng, area, picture, street)
    mottle = _tile(rng, slope=1.0, contrast=0.07)
    across = -(-area.width // _TILE)
    for top in range(0, area.height, _TILE):
        rows = picture[top:top + _TILE]
        patch = np.tile(mottle[:len(rows)], (1, across))[:, :area.width]
        rows[:] = cv2.multiply(rows, patch, scale=1 / 128)
    picture = as_bytes(cv2.multiply(picture, _shade(area, shadows), scale=1 / 128))
    (x, y) = area.origin.tolist()
    grain = _tile(rng, slope=0.2, contrast=0.2)
    return Ground(pyramid(picture), (x, y), area.density, pyramid(grain), _GRAIN_DENSITY)
