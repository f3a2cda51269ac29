# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
All textures of the walls in one image, reduced in either direction by any power of two.

Such a *ripmap* lets one ``cv2.remap`` draw every wall of a view without aliasing: a wall seen at
a grazing angle is reduced along its length only, a distant one in both directions.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from phase_traj_ros.synthetic.arrays import as_bytes, Bytes, Floats, Ints

#: Largest reduction in each direction, as a power of 2.
LEVELS = 6

_GRID = 32
_SHEET_WIDTH = 4096


@dataclass(frozen=True, slots=True, eq=False)
class Atlas:
    """
    The image, and the positions of the full-size textures in it.

    ``image``: (2 h, 2 w) uint8, of which [:h, :w] is the sheet of full-size textures;
    ``left``, ``bottom``: (T,) pixels; ``length``, ``height``: (T,) metres; ``density``: (T,)
    pixels per metre.
    """

    image: Bytes
    left: Floats
    bottom: Floats
    length: Floats
    height: Floats
    density: Floats


def in_ripmap(edge: Floats, level: Ints, size: int) -> Floats:
    """
    Return rows or columns of the image for those of the sheet at these levels.

    ``edge`` is from the edge of the sheet, the result from the centre of a pixel; ``size`` is that
    of the image.
    """
    shrink: Floats = np.exp2(-level.astype(np.float64))
    return size * (1.0 - shrink) + edge * shrink - 0.5


def level_of(footprint: Floats) -> Ints:
    """Return the level at which a texel is as large as the pixel, given texels per pixel."""
    levels = np.rint(np.log2(np.maximum(footprint, 1.0)))
    return np.clip(levels, 0, LEVELS).astype(np.int64)


def _grown(size: int) -> int:
    """Add a margin, so that neighbouring textures mix at high levels only."""
    return (size + _GRID // 2 + _GRID - 1) // _GRID * _GRID


def _packed(pictures: Sequence[Bytes]) -> tuple[Bytes, Ints]:
    """Arrange the textures on shelves; return the sheet and the (left, top) of each, (T, 2)."""
    places = np.zeros((len(pictures), 2), np.int64)
    (x, y, shelf) = (0, 0, 0)
    for index in sorted(range(len(pictures)), key=lambda i: -pictures[i].shape[0]):
        (height, width) = (_grown(size) for size in pictures[index].shape)
        if x + width > _SHEET_WIDTH:
            (x, y, shelf) = (0, y + shelf, 0)
        places[index] = (x, y)
        (x, shelf) = (x + width, max(shelf, height))
    grid = 2 ** LEVELS
    sheet = np.zeros(((y + shelf + grid - 1) // grid * grid, _SHEET_WIDTH), np.uint8)
    for (picture, (left, top)) in zip(pictures, places):
        (height, width) = picture.shape
        sheet[top:top + _grown(height), left:left + _grown(width)] = cv2.copyMakeBorder(
            picture, 0, _grown(height) - height, 0, _grown(width) - width, cv2.BORDER_REPLICATE)
    return (sheet, places)


def _ripmap(sheet: Bytes) -> Bytes:
    """Reduce the sheet in both directions independently."""
    (height, width) = sheet.shape
    image = np.zeros((2 * height, 2 * width), np.uint8)
    tall = sheet
    for row in range(LEVELS + 1):
        wide = tall
        top = 2 * height - 2 * (height >> row)
        for column in range(LEVELS + 1):
            left = 2 * width - 2 * (width >> column)
            image[top:top + wide.shape[0], left:left + wide.shape[1]] = wide
            wide = as_bytes(cv2.resize(
                wide, (wide.shape[1] // 2, wide.shape[0]), interpolation=cv2.INTER_AREA))
        tall = as_bytes(cv2.resize(
            tall, (tall.shape[1], tall.shape[0] // 2), interpolation=cv2.INTER_AREA))
    return image


def build_atlas(pictures: Sequence[Bytes], densities: Sequence[float]) -> Atlas:
    """Join textures, each (h, w) uint8 with its pixels per metre, into one atlas."""
    (sheet, places) = _packed(pictures)
    image = _ripmap(sheet)
    image.flags.writeable = False
    density = np.array(densities, np.float64)
    size = np.array([picture.shape for picture in pictures], np.float64)
    return Atlas(
        image=image, left=places[:, 0].astype(np.float64), bottom=places[:, 1] + size[:, 0],
        length=size[:, 1] / density, height=size[:, 0] / density, density=density)
