# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Renders the frames of a drive."""

from __future__ import annotations

from collections.abc import Iterator

from phase_traj_ros.synthetic.arrays import Bytes
from phase_traj_ros.synthetic.degradations import sensor_noise
from phase_traj_ros.synthetic.drive.drive import Drive
from phase_traj_ros.synthetic.scene.scene import Scene
from phase_traj_ros.synthetic.view.renderer import render

# Standard deviation of the noise of the sensor by day, in grey levels.
_NOISE = 1.0


def render_drive(drive: Drive, *, scene: Scene | None = None) -> Iterator[Bytes]:
    """
    Yield the frames of a drive in order, each (height, width) uint8, with the sensor's noise.

    The noise has a standard deviation of one grey level: a camera that stands gives no picture
    twice. Each frame is rendered on demand, so a drive may have any length. ``scene`` is the scene
    of the drive, if it has been built already.
    """
    seen = drive.build_scene() if scene is None else scene
    for frame in range(len(drive)):
        picture = render(seen, drive.camera, drive.pose(frame))
        yield sensor_noise(picture, sigma=_NOISE, seed=frame)
