# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A scene: everything a camera can see. It never changes.

Everything solid is made of panels: upright rectangles over lines on the ground.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from phase_traj_ros.synthetic.arrays import Floats, Ints
from phase_traj_ros.synthetic.scene.ground import Ground
from phase_traj_ros.synthetic.scene.sky import Sky
from phase_traj_ros.synthetic.textures.materials import Materials


class Panel(NamedTuple):
    """
    One upright panel.

    From ``start`` to ``end`` (x, y) in metres, between the heights ``base`` and ``top``, cut out
    by ``silhouette``. Its texture starts ``offset`` metres from the left edge and at the bottom,
    and is brightened by ``gain``. It is not drawn from farther away than ``reach``, in metres.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    base: float
    top: float
    texture: int
    offset: float = 0.0
    silhouette: int = 0
    gain: float = 1.0
    reach: float = 300.0


@dataclass(frozen=True, slots=True, eq=False)
class Panels:
    """Panels as arrays: ``start`` and ``end`` are (N, 2), all others (N,); see `Panel`."""

    start: Floats
    end: Floats
    base: Floats
    top: Floats
    texture: Ints
    offset: Floats
    silhouette: Ints
    gain: Floats
    reach: Floats

    @classmethod
    def of(cls, panels: Iterable[Panel]) -> Panels:
        """Join single panels."""
        columns = list(zip(*panels)) or [()] * len(Panel._fields)
        arrays: dict[str, Any] = {}
        for (name, values) in zip(Panel._fields, columns):
            kind = np.int64 if name in ('texture', 'silhouette') else np.float64
            shape = (-1, 2) if name in ('start', 'end') else (-1,)
            arrays[name] = np.array(values, kind).reshape(shape)
            arrays[name].flags.writeable = False
        return cls(**arrays)


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Upright panels with their materials, the ground below and the sky above."""

    panels: Panels
    materials: Materials
    ground: Ground
    sky: Sky
