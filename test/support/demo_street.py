# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The first frames of the demo's drive, with the distance of each pair."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from phase_traj_ros.core import CameraModel
from phase_traj_ros.synthetic import named_drive, render_drive
from smaller import HALF


@lru_cache
def street(camera=HALF, count=45):
    """Return the first frames of the demo's drive, its camera, and the true steps in metres."""
    drive = replace(named_drive('demo'), camera=camera).take(range(count))
    model = CameraModel(
        width=camera.width, height=camera.height, fx=camera.focal, fy=camera.focal, cx=camera.cx,
        cy=camera.cy)
    steps = np.hypot(*np.diff(drive.poses[:, :2], axis=0).T)
    return list(render_drive(drive)), drive.stamps_ns.tolist(), model, steps
