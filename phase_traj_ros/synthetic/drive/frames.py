# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The pictures of a drive, one after the other."""

from __future__ import annotations

from collections.abc import Iterator

from phase_traj_ros.synthetic.arrays import Bytes
from phase_traj_ros.synthetic.drive.drive import Drive
from phase_traj_ros.synthetic.scene.scene import Scene
from phase_traj_ros.synthetic.view.renderer import render


def render_drive(drive: Drive, *, scene: Scene | None = None) -> Iterator[Bytes]:
    """
    Yield the frames of a drive in order, each (height, width) uint8.

    Each is rendered when it is asked for, so that a drive may be of any length. ``scene`` saves
    building the drive's scene where it is at hand.
    """
    seen = drive.build_scene() if scene is None else scene
    for frame in range(len(drive)):
        yield render(seen, drive.camera, drive.pose(frame))
