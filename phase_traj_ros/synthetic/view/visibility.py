# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The visible parts of panels in each pixel, for a level camera.

Every panel is cut into the image columns it crosses. Such a piece, a *strip*, has one depth and
one position along the panel. In each column the strips are sorted by depth, and each row is
assigned to the nearest strip that covers it.
"""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from phase_traj_ros.synthetic.arrays import Bools, Floats, Ints
from phase_traj_ros.synthetic.camera import Camera, Pose
from phase_traj_ros.synthetic.scene.scene import Panels
from phase_traj_ros.synthetic.textures.silhouettes import Silhouettes

#: Nearest distance from the camera's plane that is drawn, in metres.
_NEAR = 0.3
#: Largest number of strips visible behind each other in a column.
_LAYERS = 14

_Number = TypeVar('_Number', bound=np.generic)


@dataclass(frozen=True, slots=True, eq=False)
class Strips:
    """
    Pieces of panels, one column wide; all arrays are (S,).

    ``panel``: its panel; ``column``: its column; ``depth``: distance from the camera's plane,
    ``along``: distance from the panel's start, both in metres; ``stretch``: metres of the panel
    per column; rows ``first`` to ``last`` (exclusive) are covered; ``grounded``: it extends to
    the ground.
    """

    panel: Ints
    column: Ints
    depth: Floats
    along: Floats
    stretch: Floats
    first: Ints
    last: Ints
    grounded: Bools


def cut(panels: Panels, silhouettes: Silhouettes, camera: Camera, pose: Pose) -> Strips:
    """Cut the panels in front of the camera into strips."""
    (cos, sin) = (np.cos(pose.yaw), np.sin(pose.yaw))
    # Ends in the axes of the camera: `ahead` and `right` are (2, N).
    ends = np.stack([panels.start, panels.end]) - (pose.x, pose.y)
    ahead = ends @ np.array([cos, sin])
    right = ends @ np.array([sin, -cos])
    (leftmost, rightmost) = (
        (edge - camera.cx) / camera.focal for edge in (-0.5, camera.width - 0.5))
    near = np.hypot(ahead, right).min(axis=0) < panels.reach
    seen = near & (ahead.max(axis=0) > _NEAR)
    seen &= (right - leftmost * ahead).max(axis=0) > 0
    seen &= (right - rightmost * ahead).min(axis=0) < 0
    index = np.flatnonzero(seen)
    (ahead, right) = (ahead[:, index], right[:, index])
    (deeper, wider) = (ahead[1] - ahead[0], right[1] - right[0])
    # The ends, moved along the panel to the part in front of the camera.
    safe = np.where(np.abs(deeper) > 1e-9, deeper, 1.0)
    share = np.where(ahead < _NEAR, (_NEAR - ahead[0]) / safe, np.array([[0.0], [1.0]]))
    place = camera.cx + camera.focal * (right[0] + share * wider) / (ahead[0] + share * deeper)
    first = np.clip(np.ceil(place.min(axis=0)), 0, camera.width).astype(np.int64)
    last = np.clip(np.floor(place.max(axis=0)) + 1, 0, camera.width).astype(np.int64)
    count = np.maximum(last - first, 0)

    def each(values: npt.NDArray[_Number]) -> npt.NDArray[_Number]:
        """Assign the value of its panel to each strip."""
        return np.repeat(values, count)

    column = np.arange(count.sum()) - each(np.cumsum(count) - count - first)
    slope = (column - camera.cx) / camera.focal
    (start, deeper) = (each(ahead[0]), each(deeper))
    across = each(wider) - slope * deeper
    across = np.where(np.abs(across) > 1e-9, across, 1e-9)
    share = np.clip((slope * start - each(right[0])) / across, 0.0, 1.0)
    depth = np.maximum(start + share * deeper, _NEAR)
    length = each(np.hypot(*(panels.end[index] - panels.start[index]).T))
    stretch = length * np.abs(depth / across) / camera.focal
    base = each(panels.base[index])
    height = each(panels.top[index] - panels.base[index])
    (upper, lower) = silhouettes.at(each(panels.silhouette[index]), share)
    floor = base + lower * height

    def rows(height: Floats) -> Ints:
        row = camera.cy + camera.focal * (camera.above_ground - height) / depth
        clipped: Ints = np.clip(np.ceil(row), 0, camera.height).astype(np.int64)
        return clipped

    return Strips(
        panel=each(index), column=column, depth=depth, along=share * length, stretch=stretch,
        first=rows(base + upper * height), last=rows(floor), grounded=floor <= 0)


def _nearest_first(strips: Strips) -> Ints:
    """Sort by column, then by depth, without strips that have no rows."""
    index = np.flatnonzero(strips.last > strips.first)
    millimetres = (strips.depth[index] * 1000).astype(np.int64)
    # One number each: they are sorted faster than pairs.
    depth_in_column = strips.column[index] * (millimetres.max(initial=0) + 1) + millimetres
    return index[np.argsort(depth_in_column, kind='stable')]


def _unhidden(strips: Strips, order: Ints, camera: Camera) -> tuple[Ints, Ints]:
    """Remove what nearer strips on the ground hide; return the remaining strips and their ends."""
    first = strips.first[order]
    edge = np.where(strips.grounded[order], first, camera.height)
    # All columns in one pass: in each, the edges count from a lower level than those before.
    level = strips.column[order] * (camera.height + 1)
    highest = np.minimum.accumulate(np.concatenate([[camera.height], edge - level]))[:-1]
    horizon = np.minimum(highest + level, camera.height)
    open_ = first < horizon
    return (order[open_], np.minimum(strips.last[order], horizon)[open_])


def visible(strips: Strips, camera: Camera) -> tuple[Ints, Ints]:
    """
    Assign every pixel to the nearest strip that covers it.

    Return the whole image as runs of pixels, column by column from the left, each from the top:
    the index of the strip of each, -1 for none, and its length in pixels, (R,) both.
    """
    (order, last) = _unhidden(strips, _nearest_first(strips), camera)
    column = strips.column[order]
    layer = np.arange(len(order)) - np.searchsorted(column, column)
    drawn = layer < _LAYERS

    def table(values: Ints, missing: int) -> Ints:
        """Return the values of the strips by column and layer."""
        filled = np.full((camera.width, _LAYERS), missing, np.int64)
        filled[column[drawn], layer[drawn]] = values[drawn]
        return filled

    (index, tops, bottoms) = (
        table(order, -1), table(strips.first[order], camera.height), table(last, camera.height))
    bounds = np.concatenate([
        np.zeros((camera.width, 1), np.int64), tops, bottoms,
        np.full((camera.width, 1), camera.height)], axis=1)
    bounds.sort(axis=1)
    (start, length) = (bounds[:, :-1], np.diff(bounds, axis=1))
    (columns, which) = np.nonzero(length)
    start = start[columns, which]
    covers = (tops[columns] <= start[:, None]) & (start[:, None] < bottoms[columns])
    owner = index[columns, covers.argmax(axis=1)]
    owner[~covers.any(axis=1)] = -1
    return (owner, length[columns, which])
