# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The ground: a painted map of the streets, multiplied by a fine grain."""

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from phase_traj_ros.synthetic.arrays import as_bytes, Bytes, Floats, Singles
from phase_traj_ros.synthetic.camera import Camera, Pose

_LEVELS = 7
#: Beyond this distance, in metres, the ground has a uniform tone.
_HORIZON = 400.0


def pyramid(picture: Bytes) -> tuple[Bytes, ...]:
    """Return a texture and smaller copies of it, which are for larger distances."""
    levels = [picture]
    for _ in range(_LEVELS - 1):
        (height, width) = levels[-1].shape
        levels.append(as_bytes(cv2.resize(
            levels[-1], (max(width // 2, 1), max(height // 2, 1)),
            interpolation=cv2.INTER_AREA)))
    return tuple(levels)


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """
    The flat ground, as two pyramids of textures.

    ``paint``: the map, rows along y and columns along x, ``paint_density`` pixels per metre, the
    corner of its first pixel at ``origin``; ``grain``: a square tile repeated everywhere, neutral
    at 128.
    """

    paint: tuple[Bytes, ...]
    origin: tuple[float, float]
    paint_density: float
    grain: tuple[Bytes, ...]
    grain_density: float

    def draw(self, picture: Bytes, camera: Camera, pose: Pose) -> None:
        """Draw all rows of ``picture`` below the horizon, as seen by a level camera."""
        first = min(max(int(np.floor(camera.cy)) + 1, 0), camera.height)
        below = np.arange(first, camera.height, dtype=np.float64) - camera.cy
        depth = camera.focal * camera.above_ground / below
        near = first + int(np.count_nonzero(depth > _HORIZON))
        picture[first:near] = int(self.paint[-1].mean())
        depth = depth[near - first:]
        # A pixel covers depth / f across and depth ** 2 / (f h) along the viewing direction.
        footprint = depth ** 1.5 / (camera.focal * camera.above_ground ** 0.5)
        (paint, grain) = (
            np.clip(np.rint(np.log2(footprint * density)), 0, _LEVELS - 1).astype(int)
            for density in (self.paint_density, self.grain_density))
        edges = np.flatnonzero(np.diff(paint) | np.diff(grain)) + 1
        for (begin, end) in pairwise([0, *edges.tolist(), len(depth)]):
            if end > begin:
                picture[near + begin:near + end] = self._band(
                    camera, pose, depth[begin:end], int(paint[begin]), int(grain[begin]))

    def _band(
        self, camera: Camera, pose: Pose, depth: Floats, paint_level: int, grain_level: int,
    ) -> Bytes:
        """Draw rows with common pyramid levels; ``depth`` is (R,)."""
        slope = (np.arange(camera.width) - camera.cx) / camera.focal
        (cos, sin) = (np.cos(pose.yaw), np.sin(pose.yaw))
        directions = (cos + slope * sin, sin - slope * cos)
        scale = self.paint_density / 2 ** paint_level
        (x, y) = (
            _affine(depth, direction, scale, (position - corner) * scale - 0.5)
            for (position, corner, direction) in zip(pose[:2], self.origin, directions))
        paint = cv2.remap(
            self.paint[paint_level], x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        tile = self.grain[grain_level]
        scale = self.grain_density / 2 ** grain_level
        (x, y) = (
            _affine(depth, direction, scale, (position * scale - 0.5) % len(tile))
            for (position, direction) in zip(pose[:2], directions))
        for place in (x, y):
            place -= np.floor(place * np.float32(1 / len(tile))) * np.float32(len(tile))
        grain = cv2.remap(tile, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        return as_bytes(cv2.multiply(paint, grain, scale=1 / 128))


def _affine(depth: Floats, direction: Floats, scale: float, offset: float) -> Singles:
    """Return offset + scale * depth * direction, (R, W) float32."""
    place = np.outer((depth * scale).astype(np.float32), direction.astype(np.float32))
    place += np.float32(offset)
    return place
