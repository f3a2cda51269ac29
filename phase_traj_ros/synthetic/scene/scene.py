# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A scene: everything a camera can see, fixed for ever."""

from __future__ import annotations

from dataclasses import dataclass

from phase_traj_ros.synthetic.scene.ground import Ground
from phase_traj_ros.synthetic.scene.panels import Panels
from phase_traj_ros.synthetic.scene.sky import Sky
from phase_traj_ros.synthetic.textures.materials import Materials


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Upright panels and what they are made of, the ground they stand on, the sky above."""

    panels: Panels
    materials: Materials
    ground: Ground
    sky: Sky
