# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Random fronts of houses: plaster or brick, with windows, doors, bands and pipes."""

from itertools import pairwise

import numpy as np
from phase_traj_ros.synthetic.arrays import Floats, Singles
from phase_traj_ros.synthetic.textures.noise import Sheet


class _Canvas:
    """A wall drawn in metres: x along it, z up from the ground."""

    def __init__(self, sheet: Sheet) -> None:
        self.rng = sheet.rng
        self.picture = _plaster(sheet)
        self._density = sheet.density

    def _pixels(self, value: float) -> int:
        return round(value * self._density)

    def box(
        self, left: float, bottom: float, width: float, height: float, *,
        tone: float, keep: float = 0.0,
    ) -> None:
        """Paint a rectangle, leaving the share ``keep`` of what was there."""
        rows = len(self.picture)
        area = self.picture[
            max(rows - self._pixels(bottom + height), 0):max(rows - self._pixels(bottom), 0),
            max(self._pixels(left), 0):max(self._pixels(left + width), 0)]
        area *= keep
        area += tone * (1.0 - keep)


def _brick_courses(sheet: Sheet) -> Singles:
    """Return the relative brightness of brickwork."""
    (rng, (height, width)) = (sheet.rng, sheet.shape)
    (course, brick) = (0.083, rng.uniform(0.22, 0.3))
    rows = np.arange(height) / sheet.density / course
    columns = np.arange(width) / sheet.density / brick
    row = rows.astype(int)
    # Every second course is offset by half a brick.
    place = columns[None, :] + 0.5 * (row[:, None] % 2)
    tones = rng.normal(1.0, 0.13, (row[-1] + 1, int(columns[-1]) + 2))
    picture = tones[row[:, None], place.astype(int)]
    mortar = ((rows % 1.0) < 0.16)[:, None] | ((place % 1.0) < 0.06)
    picture[mortar] = rng.uniform(1.1, 1.4)
    bricks: Singles = picture.astype(np.float32)
    return bricks


def _plaster(sheet: Sheet) -> Singles:
    """Return a bare wall with grain, stains and streaks of rain."""
    rng = sheet.rng
    picture = np.full(sheet.shape, rng.uniform(120, 235), np.float32)
    if rng.random() < 0.35:
        picture *= 0.7 * _brick_courses(sheet)
    picture *= 1.0 + 0.035 * sheet.noise(0.5)
    picture *= 1.0 + rng.uniform(0.02, 0.07) * sheet.noise(1.0)
    streaks = sheet.noise(0.5, down=24)
    picture *= 1.0 + rng.uniform(0.005, 0.03) * streaks
    return picture


def _slats(canvas: _Canvas, left: float, bottom: float, width: float, height: float, *,
           tone: float, pitch: float) -> None:
    """Draw a shutter: dark gaps between slats."""
    canvas.box(left, bottom, width, height, tone=tone, keep=0.1)
    for z in np.arange(bottom, bottom + height - pitch / 2, pitch):
        canvas.box(left, float(z), width, 0.3 * pitch, tone=0.45 * tone)


def _window(
    canvas: _Canvas, left: float, bottom: float, width: float, height: float, *, frame: float,
    shutters: bool,
) -> None:
    """Draw a window: frame, sill and its shadow, glass, bars, perhaps a blind or shutters."""
    rng = canvas.rng
    canvas.box(left - 0.1, bottom - 0.1, width + 0.2, height + 0.2, tone=frame, keep=0.1)
    canvas.box(left - 0.18, bottom - 0.17, width + 0.36, 0.09, tone=1.15 * frame)
    canvas.box(left - 0.14, bottom - 0.3, width + 0.28, 0.13, tone=60.0, keep=0.4)
    canvas.box(left, bottom, width, height, tone=rng.uniform(15, 55), keep=0.08)
    # A reflection in the glass, or a curtain.
    (dx, dz) = rng.uniform(0.0, 0.6, 2)
    canvas.box(
        left + dx * width, bottom + dz * height, 0.4 * width, 0.4 * height,
        tone=rng.uniform(30, 150), keep=0.5)
    for part in range(1, int(rng.integers(1, 4))):
        canvas.box(left + part * width / 3 - 0.03, bottom, 0.06, height, tone=frame)
    if rng.random() < 0.4:
        canvas.box(left, bottom + 0.68 * height, width, 0.06, tone=frame)
    if rng.random() < 0.4:
        drop = rng.uniform(0.15, 1.0) * height
        _slats(canvas, left, bottom + height - drop, width, drop,
               tone=rng.uniform(110, 220), pitch=0.09)
    # Shadow of the lintel.
    canvas.box(left, bottom + height - 0.12, width, 0.12, tone=10.0, keep=0.5)
    if shutters:
        tone = rng.uniform(50, 150)
        for x in (left - 0.62 * width, left + 1.12 * width):
            _slats(canvas, x, bottom, 0.5 * width, height, tone=tone, pitch=0.11)


def _columns(rng: np.random.Generator, length: float) -> list[tuple[float, float]]:
    """Return (left edge, width) of the windows along a wall; the spacing is never even."""
    columns: list[tuple[float, float]] = []
    x = rng.uniform(0.5, 1.8)
    while True:
        width = rng.uniform(0.7, 1.9)
        if x + width > length - 0.3:
            return columns
        columns.append((x, width))
        x += width + rng.uniform(0.9, 2.8)


def _floors(rng: np.random.Generator, height: float) -> Floats:
    """Return the heights of the floors."""
    floors = [rng.uniform(0.3, 1.0)]
    while floors[-1] < height:
        floors.append(floors[-1] + rng.uniform(2.6, 3.4))
    return np.array(floors)


def facade(sheet: Sheet) -> Singles:
    """
    Return the front of a house, whose bottom row is at the ground.

    No two fronts have the same spacing of windows.
    """
    (rng, length, height) = (sheet.rng, sheet.length, sheet.height)
    canvas = _Canvas(sheet)
    floors = _floors(rng, height)
    frame = rng.choice([rng.uniform(40, 90), rng.uniform(180, 250)])
    shutters = rng.random() < 0.35
    columns = _columns(rng, length)
    sill = rng.uniform(0.75, 1.0)
    canvas.box(0, 0, length, float(floors[0]), tone=rng.uniform(40, 130), keep=0.3)
    for (ground, (floor, ceiling)) in enumerate(pairwise(floors)):
        if rng.random() < 0.3:
            canvas.box(0, ceiling - 0.15, length, rng.uniform(0.1, 0.3),
                       tone=rng.uniform(60, 240), keep=0.2)
        story = min(rng.uniform(1.2, 1.7), ceiling - floor - sill - 0.3)
        for (left, width) in columns:
            if ground == 0 and rng.random() < 0.25:
                canvas.box(left - 0.15, 0.0, width + 0.3, 2.35, tone=frame, keep=0.2)
                canvas.box(left, 0.0, width, 2.2, tone=rng.uniform(25, 140), keep=0.2)
            elif rng.random() < 0.88:
                _window(canvas, left, floor + sill, width, story, frame=frame, shutters=shutters)
    for x in rng.uniform(0, length, int(rng.integers(0, 3))):
        canvas.box(x, 0, 0.1, height, tone=rng.uniform(60, 200))
        canvas.box(x + 0.1, 0, 0.06, height, tone=40, keep=0.5)
    canvas.picture *= 1.0 + 0.02 * sheet.noise(0.0)
    return canvas.picture
