# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The visible parts of panels in each pixel, for a level camera.

Every panel is cut into the image columns it crosses. Such a piece, a *strip*, has one depth and
one position along the panel. In each column the strips are sorted by depth, and each row is
assigned to the nearest strip that covers it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from phase_traj_ros.synthetic.arrays import Bools, Floats, Ints
from phase_traj_ros.synthetic.camera import Camera, Pose
from phase_traj_ros.synthetic.scene.panels import Panels
from phase_traj_ros.synthetic.textures.silhouettes import Silhouettes

#: Nearest distance from the camera's plane that is drawn, in metres.
_NEAR = 0.3
#: Largest number of strips visible behind each other in a column.
_LAYERS = 14


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
    which = np.repeat(np.arange(len(index)), count)
    column = np.arange(len(which)) - np.repeat(np.cumsum(count) - count - first, count)

    slope = (column - camera.cx) / camera.focal
    across = wider[which] - slope * deeper[which]
    across = np.where(np.abs(across) > 1e-9, across, 1e-9)
    share = np.clip((slope * ahead[0][which] - right[0][which]) / across, 0.0, 1.0)
    depth = np.maximum(ahead[0][which] + share * deeper[which], _NEAR)
    panel = index[which]
    length = np.hypot(*(panels.end - panels.start)[panel].T)
    stretch = length * np.abs(depth / across) / camera.focal
    (base, top) = (panels.base[panel], panels.top[panel])
    (upper, lower) = silhouettes.at(panels.silhouette[panel], share)

    def rows(height: Floats) -> Ints:
        row = camera.cy + camera.focal * (camera.above_ground - height) / depth
        clipped: Ints = np.clip(np.ceil(row), 0, camera.height).astype(np.int64)
        return clipped

    return Strips(
        panel=panel, column=column, depth=depth, along=share * length, stretch=stretch,
        first=rows(base + upper * (top - base)), last=rows(base + lower * (top - base)),
        grounded=base + lower * (top - base) <= 0)


def _nearest_first(strips: Strips) -> Ints:
    """Sort by column, then by depth, without strips that have no rows."""
    index = np.flatnonzero(strips.last > strips.first)
    millimetres = (strips.depth[index] * 1000).astype(np.int64)
    order: Ints = index[np.lexsort((millimetres, strips.column[index]))]
    return order


def _table(column: Ints, values: Ints, width: int, missing: int) -> Ints:
    """Write the values, sorted by column, into the rows of a (width, most per column) table."""
    count = np.bincount(column, minlength=width)
    rank = np.arange(len(column)) - (np.cumsum(count) - count)[column]
    table = np.full((width, max(int(count.max(initial=0)), 1)), missing, np.int64)
    table[column, rank] = values
    return table


def _unhidden(strips: Strips, order: Ints, camera: Camera) -> tuple[Ints, Ints]:
    """Remove what nearer strips on the ground hide; return the remaining strips and their ends."""
    column = strips.column[order]
    edges = np.where(strips.grounded[order], strips.first[order], camera.height)
    edge = _table(column, edges, camera.width, camera.height)
    above = np.minimum.accumulate(edge, axis=1)
    before = np.concatenate([np.full((camera.width, 1), camera.height), above[:, :-1]], axis=1)
    rank = np.arange(len(column)) - np.searchsorted(column, column)
    horizon = before[column, rank]
    open_ = strips.first[order] < horizon
    return (order[open_], np.minimum(strips.last[order], horizon)[open_])


def visible(strips: Strips, camera: Camera) -> tuple[Ints, Ints]:
    """
    Assign every pixel to the nearest strip that covers it.

    Return the whole image as runs of pixels, column by column from the left, each from the top:
    the index of the strip of each, -1 for none, and its length in pixels, (R,) both.
    """
    (order, last) = _unhidden(strips, _nearest_first(strips), camera)
    column = strips.column[order]
    index = _table(column, order, camera.width, -1)[:, :_LAYERS]
    tops = _table(column, strips.first[order], camera.width, camera.height)[:, :_LAYERS]
    bottoms = _table(column, last, camera.width, camera.height)[:, :_LAYERS]
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
