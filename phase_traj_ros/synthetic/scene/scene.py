# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A scene: everything a camera can see. It never changes."""

from __future__ import annotations

from dataclasses import dataclass

from phase_traj_ros.synthetic.scene.ground import Ground
from phase_traj_ros.synthetic.scene.panels import Panels
from phase_traj_ros.synthetic.scene.sky import Sky
from phase_traj_ros.synthetic.textures.materials import Materials


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Upright panels with their materials, the ground below and the sky above."""

    panels: Panels
    materials: Materials
    ground: Ground
    sky: Sky
