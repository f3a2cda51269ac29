# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Complete scenes: a grid of streets, or a street along any route."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from phase_traj_ros.synthetic.arrays import Floats
from phase_traj_ros.synthetic.scene.scene import Panels, Scene
from phase_traj_ros.synthetic.scene.sky import build_sky
from phase_traj_ros.synthetic.textures.materials import materials
from phase_traj_ros.synthetic.town.buildings import build, ROADWAY, Town
from phase_traj_ros.synthetic.town.keep_out import KeepOut
from phase_traj_ros.synthetic.town.paving import pave
from phase_traj_ros.synthetic.town.streets import grid_streets, HALF_WIDTH, Street, streets_along

#: Smallest distance of anything solid from a pose, in metres.
CLEARANCE = 4.0
#: Footprints are checked at points up to half a metre apart; this covers what is in between.
_BETWEEN = 0.3
#: How far a house may reach into another street, in metres.
_INTO = 0.6


def _scene(streets: Sequence[Street], clear_of: npt.ArrayLike, seed: int) -> Scene:
    poses = np.asarray(clear_of, np.float64).reshape(-1, 2)
    rng = np.random.default_rng((seed, 2))
    angle = rng.uniform(0.0, 2 * np.pi)
    lines = [street.line for street in streets]
    town = Town(
        rng=rng, materials=materials(), poses=KeepOut([poses], CLEARANCE + _BETWEEN),
        corridors=KeepOut(lines, HALF_WIDTH - _INTO), roadways=KeepOut(lines, ROADWAY),
        sun=np.array([np.cos(angle), np.sin(angle)]))
    build(town, streets)
    return Scene(
        panels=Panels.of(town.panels), materials=town.materials,
        ground=pave(rng, streets, town.shadows), sky=build_sky(rng))


def street_grid(
    xs: Sequence[float], ys: Sequence[float], *, seed: int = 0,
    clear_of: npt.ArrayLike = (),
) -> Scene:
    """
    Return a town whose streets form a grid.

    Streets run north and south at each of ``xs``, east and west at each of ``ys`` (metres), and
    extend beyond the outermost crossings. Nothing solid is within 4 m of ``clear_of`` (N, 2).
    """
    return _scene(grid_streets(xs, ys), clear_of, seed)


def scene_along(poses_xy: npt.ArrayLike, *, seed: int = 0) -> Scene:
    """
    Return a town whose streets follow a route.

    ``poses_xy`` (N, 2), in metres, may cross itself, turn at any angle and contain stops. The
    fronts are 7 to 10 m from it on both sides, with side streets. Nothing solid is within 4 m of
    the points.
    """
    return _scene(streets_along(poses_xy, np.random.default_rng((seed, 3))), poses_xy, seed)


def roads_along(poses_xy: npt.ArrayLike, *, seed: int = 0) -> list[Floats]:
    """Return the roads of ``scene_along``: centre lines (N, 2) that share their crossings."""
    streets = streets_along(poses_xy, np.random.default_rng((seed, 3)))
    return [street.line for street in streets if not street.again]
