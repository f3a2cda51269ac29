# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes the state of a running estimator to files."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
import math
from pathlib import Path
from typing import Any

import numpy as np
from phase_traj_ros.core import (
    CameraEstimate,
    Corner,
    EstimatorSettings,
    Movement,
    Run,
    TrajectoryEstimator,
)
from phase_traj_ros.core.camera.estimate import FieldOfView
from phase_traj_ros.core.heading.estimator import HeadingEstimator
from phase_traj_ros.core.heading.turns import Turn
from phase_traj_ros.core.reliability import Reliability
from phase_traj_ros.io.outputs.outputs import output_directory
from phase_traj_ros.io.results.camera_file import CAMERA_FILE, write_camera
from phase_traj_ros.io.results.figures import write_path_picture
from phase_traj_ros.io.results.files import (
    camera_content,
    links_content,
    reliability_content,
    run_pairs,
    tum_lines,
    turn_list,
    versions,
    way_content,
    write_json,
)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """
    The state of an estimator at one time. It does not change when the estimator continues.

    Runs and corners are the newest ones, as many as the estimator keeps.
    """

    source: str
    frames: int
    settings: EstimatorSettings
    movement_runs: tuple[Run[Movement], ...]
    direction_runs: tuple[Run[Any], ...]
    movement_totals: tuple[int, ...]
    """Number of occurrences of each code, from code 0 on."""
    direction_totals: tuple[int, ...]
    corners: tuple[Corner, ...]
    """Start or oldest kept corner first, current pose last; empty before the first frame."""
    counters: Mapping[str, int]
    turns: tuple[Turn, ...]
    """Turns that have ended, if the heading is measured."""
    reliability: Reliability
    """Whether the codes so far are reliable."""
    heading: '_Heading | None'
    learned: CameraEstimate | None
    """Camera as learned from the drive; None if it was not learned."""
    way: Mapping[str, Any]
    """Distance and equal links in the form of the files."""

    @classmethod
    def of(cls, estimator: TrajectoryEstimator, *, source: str) -> 'Snapshot':
        """Take a snapshot of ``estimator``."""
        codes, path = estimator.codes, estimator.path
        return cls(
            source, estimator.frames, estimator.settings, codes.movement.runs,
            codes.direction.runs,
            codes.movement.totals_of(Movement), codes.direction.totals_of(codes.directions),
            path.corners if path.tip is None else (*path.corners, path.tip),
            estimator.counters.as_dict(), estimator.turns, estimator.reliability.of_drive,
            None if estimator.heading is None else _Heading.of(estimator.heading),
            None if estimator.heading is None else estimator.heading.learned,
            {**way_content(estimator.way, unit=estimator.settings.length_unit),
             **links_content(estimator.links, unit=estimator.settings.length_unit)})

    def write(self, directory: Path) -> None:
        """
        Write chain_code.json, trajectory.tum and trajectory.png, completely or not at all.

        If the camera was learned from the drive, write camera.yaml as well.

        Raises
        ------
        OutputError
            The files cannot be written.
        MissingDependencyError
            matplotlib is not installed.

        """
        with output_directory(directory) as staging:
            write_json(self._content(), staging / 'chain_code.json')
            (staging / 'trajectory.tum').write_text(
                tum_lines((corner.stamp_ns, corner) for corner in self.corners),
                encoding='utf-8')
            points = np.array(
                [(corner.x, corner.y) for corner in self.corners] or [(0, 0)], np.float64)
            write_path_picture(points, staging / 'trajectory.png')
            if self.learned is not None:
                write_camera(
                    self.learned, staging / CAMERA_FILE,
                    rotate_180=self.settings.view.rotate_180)

    def _content(self) -> dict[str, object]:
        return {
            'source': self.source,
            'frames': self.frames,
            'threshold': self.settings.threshold_set,
            'code_source': self.settings.code_source.value,
            'connectivity': self.settings.connectivity,
            'path_from': self.settings.drawn_from.value,
            'movement_runs': run_pairs(self.movement_runs),
            'direction_runs': run_pairs(self.direction_runs),
            'movement_totals': self.movement_totals,
            'direction_totals': self.direction_totals,
            'counters': dict(self.counters),
            **reliability_content(self.reliability),
            'turns': turn_list(self.turns),
            **({} if self.heading is None else asdict(self.heading)),
            'versions': versions(),
            **self.way,
        }


@dataclass(frozen=True, slots=True)
class _Heading:
    """State of heading and camera."""

    heading_deg: float
    bridged_share: float
    focal_px: float
    field_of_view: FieldOfView | None
    camera: dict[str, Any] | None

    @classmethod
    def of(cls, heading: HeadingEstimator) -> '_Heading':
        return cls(
            math.degrees(heading.tracker.heading), heading.tracker.bridged_share,
            heading.focal_px, heading.field_of_view,
            None if heading.camera is None else camera_content(heading.camera))
