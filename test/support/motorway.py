# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A straight motorway between fields: markings and a fine grain, and hills on the horizon."""

from dataclasses import replace
from functools import cache

import numpy as np
from phase_traj_ros.synthetic import Camera, plan_drive, render_drive, Straight
from phase_traj_ros.synthetic.scene.ground import Ground, pyramid
from phase_traj_ros.synthetic.scene.scene import Panels
import textures

_DENSITY = 10
_LEFT, _BEHIND, _WIDTH = 40, 20, 80


def driven(*, grain, seconds=6.0, speed=33.0, rate_hz=25, size=(640, 360)):
    """
    Return the camera, the stamps and the frames of a drive straight ahead.

    ``grain`` is the contrast of the ground, in shares of its brightness.
    """
    camera = Camera.with_field_of_view(*size, 70, above_ground=1.3)
    drive = plan_drive(
        '', [Straight(seconds)], rate_hz=rate_hz, speed=speed, camera=camera, seed=4)
    town = _town()
    scene = replace(town, panels=Panels.of(()), ground=_ground(
        speed * seconds + 400.0, grain, town.ground.grain_density))
    return camera, drive.stamps_ns.tolist(), list(render_drive(drive, scene=scene))


@cache
def _town():
    """Return a short town, for its sky and its materials."""
    return plan_drive('', [Straight(0.1)], seed=4).build_scene()


def _ground(ahead, grain, grain_density):
    paint = np.full((_WIDTH * _DENSITY, round((ahead + _BEHIND) * _DENSITY)), 120, np.uint8)

    def line(left, right, grey, begin=-_BEHIND, end=ahead):
        rows = slice(*(round((edge + _LEFT) * _DENSITY) for edge in (left, right)))
        paint[rows, round((begin + _BEHIND) * _DENSITY):round((end + _BEHIND) * _DENSITY)] = grey

    line(-9.0, 6.0, 95)
    for edge in (-8.5, 5.3):
        line(edge, edge + 0.2, 190)
    for lane in (-1.9, 1.8):
        for begin in np.arange(0.0, ahead - 6.0, 18.0):
            line(lane, lane + 0.2, 190, begin, begin + 6.0)
    shape = 512, 512
    tile = textures.shifted(textures.spectrum(shape, 3), shape, 0, 0)
    tile = np.clip(128 * (1.0 + grain * tile / tile.std()), 0, 255).astype(np.uint8)
    return Ground(
        pyramid(paint), (-_BEHIND, -_LEFT), _DENSITY, pyramid(tile), grain_density)
