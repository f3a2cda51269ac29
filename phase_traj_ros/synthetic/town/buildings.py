# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Builds houses, trees and parked cars along streets from panels."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
import math

import numpy as np
from phase_traj_ros.synthetic.arrays import Floats
from phase_traj_ros.synthetic.scene.scene import Panel
from phase_traj_ros.synthetic.textures.materials import Material, Materials
from phase_traj_ros.synthetic.textures.silhouettes import Outline
from phase_traj_ros.synthetic.town.keep_out import KeepOut
from phase_traj_ros.synthetic.town.streets import HALF_WIDTH, left_of, Street, unit

#: Half the width of the carriageway, in metres.
ROADWAY = 4.4
#: Distance between the points at which a footprint is checked, in metres.
_CHECK = 0.5
#: The end of a street is visible from this far, in metres.
_END_REACH = 700.0
#: Smallest width of a house, in metres.
_NARROWEST = 3.0


@dataclass(slots=True, eq=False)
class Town:
    """
    What has been built so far.

    ``poses``: where nothing solid may be; ``corridors``: where no house may be; ``roadways``:
    where no tree or car may be; ``sun``: unit vector on the ground towards the sun; ``shadows``:
    polygons on the ground (K, 2).
    """

    rng: np.random.Generator
    materials: Materials
    poses: KeepOut
    corridors: KeepOut
    roadways: KeepOut
    sun: Floats
    panels: list[Panel] = field(default_factory=list)
    shadows: list[Floats] = field(default_factory=list)

    def _any(self, material: Material) -> int:
        return self._one_of(self.materials.members[material])

    def _outline(self, outline: Outline) -> int:
        return self._one_of(self.materials.silhouettes.members[outline])

    def _one_of(self, members: Sequence[int]) -> int:
        # NumPy's choice would make an array of them.
        return members[int(self.rng.integers(len(members)))]

    def lit(self, normal: Floats) -> float:
        """Return the brightness of a wall that faces along ``normal`` (a unit vector)."""
        return 0.42 + 0.8 * max(float(normal @ self.sun), 0.0)

    def wall(
        self, start: Floats, end: Floats, top: float, material: Material, *,
        base: float = 0.0, gain: float = 1.0, outline: Outline = Outline.SQUARE,
        reach: float = 300.0, texture: int | None = None,
    ) -> None:
        """Add one panel, unless it is too near to a pose."""
        length = float(np.hypot(*(end - start)))
        if not self.poses.clear(_samples(start, end)).all():
            return
        chosen = self._any(material) if texture is None else texture
        atlas = self.materials.atlas
        slack = max(float(atlas.length[chosen]) - length, 0.0)
        self.panels.append(Panel(
            start=(float(start[0]), float(start[1])), end=(float(end[0]), float(end[1])),
            base=base, top=min(top, base + float(atlas.height[chosen])), texture=chosen,
            offset=float(self.rng.uniform(0.0, slack)), silhouette=self._outline(outline),
            gain=gain, reach=reach))

    def free_stretch(
        self, start: Floats, end: Floats, *, ignore: int | None = None,
    ) -> tuple[Floats, Floats] | None:
        """Return the longest part of a line where a house may be; None if it is too short."""
        points = _samples(start, end)
        free = self.poses.clear(points) & self.corridors.clear(points, ignore=ignore)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(int)))
        if not len(edges):
            return None
        (first, last) = max(edges.reshape(-1, 2), key=lambda run: run[1] - run[0])
        (begin, finish) = (points[first], points[last - 1])
        return (begin, finish) if np.hypot(*(finish - begin)) >= _NARROWEST else None

    def house(self, start: Floats, end: Floats, away: Floats, *, reach: float = 300.0) -> None:
        """Build a house: a front from start to end, and sides that go ``away`` from the street."""
        rng = self.rng
        eaves = rng.uniform(5.0, 12.0)
        (gain, depth) = (rng.uniform(0.75, 1.15), rng.uniform(6.0, 10.0))
        ridge = eaves + rng.uniform(1.6, 3.2) if rng.random() < 0.6 else eaves
        texture = self._any(Material.FACADE)
        along = unit(end - start)
        self.wall(start, end, eaves, Material.FACADE, gain=gain * self.lit(-away),
                  texture=texture, reach=reach)
        if ridge > eaves:
            self.wall(start, end, ridge, Material.ROOF, base=eaves,
                      gain=0.6 + self.lit(-away) / 2, reach=reach)
        for (corner, normal) in ((start, -along), (end, along)):
            back = corner + depth * away
            if self.corridors.clear(_samples(corner, back)[1:]).all():
                light = gain * self.lit(normal)
                self.wall(corner, back, eaves, Material.FACADE, gain=light, texture=texture)
                if ridge > eaves:
                    self.wall(corner, back, ridge, Material.ROOF, base=eaves, gain=light,
                              outline=Outline.GABLE)
        self.shade(np.stack([start, end]), 0.7 * eaves)

    def shade(self, line: Floats, length: float) -> None:
        """Cast the shadow of a wall on the ground."""
        self.shadows.append(np.concatenate([line, (line - length * self.sun)[::-1]]))

    def tree(self, place: Floats, *, size: float, reach: float = 150.0) -> None:
        """Plant a tree with a crown of 2 * ``size`` metres in width: two crossed panels."""
        if not self._may_stand(place + size * _RING):
            return
        angle = self.rng.uniform(0, np.pi)
        (base, top) = (0.9 * size + 0.4, self.rng.uniform(2.8, 3.8) * size)
        trunk = 0.08 * size + 0.04
        for turn in (angle, angle + np.pi / 2):
            across = np.array([np.cos(turn), np.sin(turn)])
            self.wall(place - trunk * across, place + trunk * across, 0.5 * (base + top),
                      Material.BARK, reach=0.6 * reach)
            self.wall(place - size * across, place + size * across, top, Material.FOLIAGE,
                      base=base, outline=Outline.CROWN, reach=reach,
                      gain=self.rng.uniform(0.8, 1.3))
            self.shade(np.stack([place - 0.8 * size * across, place + 0.8 * size * across])
                       - self.sun * base, 0.7 * size)

    def lamp(self, place: Floats) -> None:
        """Add a lamp post."""
        if self._may_stand(place + 0.2 * _RING):
            for across in (np.array([0.07, 0.0]), np.array([0.0, 0.07])):
                self.wall(place - across, place + across, self.rng.uniform(3.5, 4.0),
                          Material.BARK, gain=self.rng.uniform(0.6, 2.2), reach=90.0)

    def car(self, place: Floats, ahead: Floats) -> None:
        """Park a car whose boot points along ``ahead`` (a unit vector)."""
        (length, width, height) = self.rng.uniform((3.7, 1.6, 1.4), (4.5, 1.78, 1.54))
        left = left_of(ahead)
        corners = place + _CORNERS @ np.stack([0.5 * length * ahead, 0.5 * width * left])
        if not self._may_stand(corners):
            return
        (body, outline) = (self._any(Material.CAR_SIDE), self._outline(Outline.CAR_SIDE))
        for side in (left, -left):
            (middle, before) = (place + 0.5 * width * side, len(self.panels))
            self.wall(middle - 0.5 * length * ahead, middle + 0.5 * length * ahead, height,
                      Material.CAR_SIDE, texture=body, gain=self.lit(side), reach=110.0)
            self.panels[before:] = [
                panel._replace(silhouette=outline, offset=0.0) for panel in self.panels[before:]]
        for (end, share) in ((ahead, 0.92), (-ahead, 0.6)):
            middle = place + 0.5 * length * end
            self.wall(middle - 0.5 * width * left, middle + 0.5 * width * left, share * height,
                      Material.CAR_END, outline=Outline.CAR_END, gain=self.lit(end),
                      reach=110.0)
        (long, wide) = (0.5 * length * ahead, 0.6 * width * left)
        self.shadows.append(place + np.stack([
            long + wide, wide - long, -long - wide, long - wide]))

    def _may_stand(self, outline: Floats) -> bool:
        return bool(self.roadways.clear(outline).all() and self.poses.clear(outline).all())


_RING = np.stack([np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)], axis=1)

_CORNERS = np.array([(1, 1), (0, 1), (-1, 1), (-1, -1), (0, -1), (1, -1)], np.float64)


def _samples(start: Floats, end: Floats) -> Floats:
    (dx, dy) = (end - start).tolist()
    return start + _shares(math.ceil(math.hypot(dx, dy) / _CHECK) + 1) * (end - start)


@cache
def _shares(count: int) -> Floats:
    """Return evenly spaced shares of a line, (count, 1)."""
    return np.linspace(0.0, 1.0, count)[:, None]


def _row_of_houses(town: Town, street: Street, side: float) -> None:
    """Build the houses on one side, with a garden wall or a hedge in the gaps."""
    (rng, total) = (town.rng, street.lengths[-1])
    place = rng.uniform(0.0, 6.0)
    while place < total - _NARROWEST:
        gap = rng.random() < 0.2
        width = min(rng.uniform(3.0, 8.0) if gap else rng.uniform(8.0, 15.0), total - place)
        setback = HALF_WIDTH + rng.uniform(0.0, 1.6)
        (start, end) = street.beside(np.array([place, place + width]), side * setback)
        away = side * left_of(unit(end - start))
        free = town.free_stretch(start, end)
        if free is not None and gap:
            material = rng.choice(np.array([Material.MASONRY, Material.FOLIAGE]))
            hedge = material is Material.FOLIAGE
            town.wall(*free, rng.uniform(1.0, 2.1), material, reach=140.0,
                      gain=town.lit(-away),
                      outline=Outline.HEDGE if hedge else Outline.SQUARE)
        elif free is not None:
            town.house(*free, away)
        place += width


def _second_row(town: Town, street: Street, side: float) -> None:
    """Put high houses and trees behind the first row, visible through the gaps."""
    (rng, total) = (town.rng, street.lengths[-1])
    place = rng.uniform(0.0, 20.0)
    while place < total:
        left = side * (HALF_WIDTH + rng.uniform(16.0, 32.0))
        (start, end) = street.beside(np.array([place, place + rng.uniform(10.0, 22.0)]), left)
        if rng.random() < 0.4:
            free = town.free_stretch(start, end)
            if free is not None:
                town.wall(*free, rng.uniform(8.0, 19.0), Material.TOWER,
                          gain=rng.uniform(0.5, 1.2))
        elif town.corridors.clear(start[None, :]).all():
            town.tree(start, size=rng.uniform(2.2, 3.6), reach=200.0)
        place += rng.uniform(10.0, 26.0)


def _furniture(town: Town, street: Street, side: float) -> None:
    """Put trees, parked cars and lamps along the road."""
    (rng, total) = (town.rng, street.lengths[-1])
    (trees, cars) = (rng.uniform(9.0, 22.0), rng.uniform(0.25, 0.8))
    place = rng.uniform(0.0, trees)
    while place < total:
        left = side * (HALF_WIDTH - rng.uniform(0.6, 1.2))
        town.tree(street.beside(np.array([place]), left)[0], size=rng.uniform(1.4, 2.1))
        place += trees * rng.uniform(0.6, 1.5)
    place = rng.uniform(0.0, 10.0)
    while place < total:
        if rng.random() < cars:
            (rear, front) = street.beside(np.array([place - 1.0, place + 1.0]), side * 5.6)
            heading = unit(front - rear)
            town.car((rear + front) / 2, heading if rng.random() < 0.7 else -heading)
        place += rng.uniform(5.0, 7.5)
    for place in np.arange(rng.uniform(0.0, 25.0), total, 27.0):
        town.lamp(street.beside(np.array([place]), side * 4.8)[0])


def _close(town: Town, street: Street, index: int) -> None:
    """Close a street with houses across its end, so that no view is endless."""
    for (end, before) in ((0, 1), (-1, -2)):
        ahead = unit(street.line[end] - street.line[before])
        left = left_of(ahead)
        for (right, width) in ((-12.0, 11.0), (-1.0, 14.0)):
            middle = street.line[end] + town.rng.uniform(1.0, 5.0) * ahead
            free = town.free_stretch(
                middle + right * left, middle + (right + width) * left, ignore=index)
            if free is not None:
                town.house(*free, ahead, reach=_END_REACH)


def build(town: Town, streets: Sequence[Street]) -> None:
    """Build along all streets that do not repeat another one."""
    for (index, street) in enumerate(streets):
        if street.again:
            continue
        _close(town, street, index)
        for side in (-1.0, 1.0):
            _row_of_houses(town, street, side)
            _second_row(town, street, side)
            _furniture(town, street, side)
