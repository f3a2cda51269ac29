# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""All textures and outlines of scenes, generated once per process."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import cache

import numpy as np
from phase_traj_ros.synthetic.arrays import Bytes, Singles
from phase_traj_ros.synthetic.textures import facades, surfaces
from phase_traj_ros.synthetic.textures.atlas import Atlas, build_atlas
from phase_traj_ros.synthetic.textures.noise import noise_bank, Sheet
from phase_traj_ros.synthetic.textures.silhouettes import build_silhouettes, Silhouettes


@dataclass(frozen=True, slots=True)
class _Recipe:
    """Number and size of textures, in metres, and their pixels per metre."""

    draw: Callable[[Sheet], Singles]
    count: int
    length: float
    height: float
    density: float


class Material(Enum):
    """Material of a panel, sharp at the smallest distance: 7 m for a front, 4 m for a car."""

    FACADE = _Recipe(facades.facade, 16, 16.0, 12.5, 56.0)
    TOWER = _Recipe(facades.facade, 6, 24.0, 22.0, 20.0)
    ROOF = _Recipe(surfaces.roof, 4, 16.0, 3.5, 40.0)
    FOLIAGE = _Recipe(surfaces.foliage, 4, 10.0, 8.0, 56.0)
    MASONRY = _Recipe(surfaces.masonry, 4, 16.0, 2.2, 64.0)
    BARK = _Recipe(surfaces.bark, 2, 0.8, 4.0, 80.0)
    CAR_SIDE = _Recipe(surfaces.car_side, 8, 4.6, 1.55, 90.0)
    CAR_END = _Recipe(surfaces.car_end, 6, 1.8, 1.55, 90.0)


@dataclass(frozen=True, slots=True, eq=False)
class Materials:
    """The atlas of textures, their indices by material, and the outlines."""

    atlas: Atlas
    members: dict[Material, tuple[int, ...]]
    silhouettes: Silhouettes


@cache
def materials() -> Materials:
    """Return the materials of all scenes; they are shared and must not be changed."""
    rng = np.random.default_rng((0, 1))
    bank = noise_bank(rng)
    pictures: list[Bytes] = []
    densities: list[float] = []
    members = {}
    for material in Material:
        recipe = material.value
        members[material] = tuple(range(len(pictures), len(pictures) + recipe.count))
        densities += [recipe.density] * recipe.count
        sheet = Sheet(rng, bank, recipe.length, recipe.height, recipe.density)
        pictures += [
            np.clip(recipe.draw(sheet), 4, 255).astype(np.uint8) for _ in range(recipe.count)]
    return Materials(build_atlas(pictures, densities), members, build_silhouettes(rng))
