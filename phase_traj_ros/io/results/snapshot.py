# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes the state of a running estimator to files."""

from dataclasses import asdict, dataclass
import math
from pathlib import Path
from typing import Any

import numpy as np
from phase_traj_ros.core import CameraEstimate, Corner, Movement, TrajectoryEstimator
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.outputs.outputs import output_directory
from phase_traj_ros.io.results.camera_file import CAMERA_FILE, write_camera
from phase_traj_ros.io.results.content import (
    camera_content,
    mount_content,
    reliability_content,
    run_pairs,
    turn_list,
    versions,
    way_content,
    write_json,
)
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
    def of(
        cls, estimator: TrajectoryEstimator, mounting: Mounting, *, source: str,
    ) -> 'Snapshot':
        """Take a snapshot of ``estimator``, whose camera is mounted so."""
        path, heading = estimator.path, estimator.heading
        return cls(
            {**_content(estimator, source), **mount_content(mounting)},
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


def _content(estimator: TrajectoryEstimator, source: str) -> dict[str, Any]:
    codes, settings, heading = estimator.codes, estimator.settings, estimator.heading
    view = None if heading is None else heading.camera.field_of_view
    return {
        'source': source,
        'frames': estimator.frames,
        'threshold': settings.threshold_set,
        'code_source': settings.code_source.value,
        'connectivity': settings.connectivity,
        'path_from': settings.drawn_from.value,
        'movement_runs': run_pairs(codes.movement.runs),
        'direction_runs': run_pairs(codes.direction.runs),
        'movement_totals': codes.movement.totals_of(Movement),
        'direction_totals': codes.direction.totals_of(codes.directions),
        'counters': dict(estimator.counters.as_dict()),
        **reliability_content(estimator.reliability.of_drive),
        'turns': turn_list(estimator.turns),
        **({} if heading is None else {
            'heading_deg': math.degrees(heading.tracker.heading),
            'bridged_share': heading.tracker.bridged_share,
            'focal_px': heading.camera.focal_px,
            'field_of_view': None if view is None else asdict(view),
            'camera': camera_content(heading.camera.in_use)}),
        'versions': versions(),
        **way_content(estimator.way, estimator.links, unit=settings.length_unit),
    }
