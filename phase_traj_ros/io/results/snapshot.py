# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes the state of a running estimator to files."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from phase_traj_ros.core import CameraEstimate, Corner, TrajectoryEstimator
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.outputs.outputs import output_directory
from phase_traj_ros.io.results.camera_file import CAMERA_FILE, write_camera
from phase_traj_ros.io.results.chain_code import chain_code_of, write_json
from phase_traj_ros.io.results.figures import write_path_picture
from phase_traj_ros.io.results.files import write_tum


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The state of an estimator at one time. It does not change when the estimator continues."""

    content: dict[str, Any]
    """What chain_code.json contains; the runs are the newest ones, as many as are kept."""
    corners: tuple[Corner, ...]
    """Start or oldest kept corner first, current pose last; empty before the first frame."""
    learned: CameraEstimate | None
    """Camera as learned from the drive; None if it was not learned."""
    rotate_180: bool
    """Whether the camera is mounted upside down."""

    @classmethod
    def of(cls, estimator: TrajectoryEstimator, mounting: Mounting, *, source: str) -> 'Snapshot':
        """Take a snapshot of ``estimator``, whose camera is mounted so."""
        path, heading = estimator.path, estimator.heading
        return cls(
            chain_code_of(estimator, mounting, source=source),
            path.corners if path.tip is None else (*path.corners, path.tip),
            None if heading is None else heading.camera.learned,
            estimator.settings.view.rotate_180)

    def write(self, directory: Path) -> None:
        """
        Write chain_code.json, trajectory.tum and trajectory.png, completely or not at all.

        If the camera was learned from the drive, write camera.yaml as well.

        Raises
        ------
        OutputError
            The files cannot be written.

        """
        with output_directory(directory) as staging:
            write_json(self.content, staging / 'chain_code.json')
            write_tum(
                ((corner.stamp_ns, corner) for corner in self.corners),
                staging / 'trajectory.tum')
            points = np.array(
                [(corner.x, corner.y) for corner in self.corners] or [(0, 0)], np.float64)
            write_path_picture(points, staging / 'trajectory.png')
            if self.learned is not None:
                write_camera(self.learned, staging / CAMERA_FILE, rotate_180=self.rotate_180)
