# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Renders the frames of a drive."""

from __future__ import annotations

from collections.abc import Iterator

from phase_traj_ros.synthetic.arrays import Bytes
from phase_traj_ros.synthetic.drive.drive import Drive
from phase_traj_ros.synthetic.scene.scene import Scene
from phase_traj_ros.synthetic.view.renderer import render


def render_drive(drive: Drive, *, scene: Scene | None = None) -> Iterator[Bytes]:
    """
    Yield the frames of a drive in order, each (height, width) uint8.

    Each is rendered on demand, so a drive may have any length. ``scene`` is the scene of the
    drive, if it has been built already.
    """
    seen = drive.build_scene() if scene is None else scene
    for frame in range(len(drive)):
        yield render(seen, drive.camera, drive.pose(frame))
