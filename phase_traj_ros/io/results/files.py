# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes a replay, or the state of a running estimator, as JSON, CSV, TUM and a picture."""

from collections.abc import Iterable
import csv
from dataclasses import dataclass
from decimal import Decimal
from itertools import chain
import math
from pathlib import Path
from typing import Any

import numpy as np
from phase_traj_ros.core import CameraEstimate, Corner, TrajectoryEstimator, Update
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.outputs.outputs import output_directory
from phase_traj_ros.io.replay.run import Replay
from phase_traj_ros.io.results.camera_file import CAMERA_FILE, write_camera
from phase_traj_ros.io.results.chain_code import chain_code_of, write_chain_code, write_json
from phase_traj_ros.io.results.figures import write_path_picture, write_trajectory_picture

RESULT_NAMES = ('chain_code.json', 'shifts.csv', 'trajectory.tum', 'trajectory.png')
"""Names of the files of ``write_results``."""

CSV_COLUMNS = (
    'pair', 'stamp', 'interval', 'dx', 'dy', 'response', 'movement', 'direction', 'status',
    'heading_deg', 'yaw_deg', 'bridged', 'distance', 'distance_variance', 'distance_state',
    'speed', 'speed_variance', 'yaw_variance')


def write_results(result: Replay, directory: Path) -> None:
    """Write all files into ``directory``."""
    write_chain_code(result, directory / 'chain_code.json')
    write_shifts(result, directory / 'shifts.csv')
    first = (result.first_stamp_ns, Corner(0, 0, 0.0, result.first_stamp_ns))
    write_tum(
        chain([first], ((update.stamp_ns, update.tip) for update in result.updates)),
        directory / 'trajectory.tum')
    write_trajectory_picture(result, directory / 'trajectory.png')


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


def write_shifts(result: Replay, path: Path) -> None:
    """Write one row per pair of frames as CSV; see ``shift_row``."""
    with path.open('w', encoding='utf-8', newline='') as file:
        table = csv.DictWriter(file, CSV_COLUMNS, restval='', lineterminator='\n')
        table.writeheader()
        table.writerows(map(shift_row, result.updates))


def shift_row(update: Update) -> dict[str, object]:
    """
    Return what is known of a pair of frames, by the names in ``CSV_COLUMNS``.

    Stamps and intervals are in seconds, shifts in pixels. There are no dx, dy and response if the
    two frames could not be compared, and no direction if none was appended. Heading and yaw are in
    degrees, positive to the left, the variance of the yaw in square degrees; ``bridged`` is 1 if
    the yaw was bridged, else 0. The four are absent if no heading is measured. Distance and speed
    are in metres, or in camera heights if no metres are known, with their variances and the state
    of the distance. The numbers are absent if the distance is unknown, all five if no distance is
    measured.
    """
    row: dict[str, object] = {
        'pair': update.pair, 'stamp': seconds_text(update.stamp_ns),
        'interval': seconds_text(update.interval_ns), 'movement': int(update.step.movement),
        'status': update.status.value}
    if update.step.appended:
        row['direction'] = int(update.step.direction)
    shift, heading, travel = update.shift, update.heading, update.travel
    if shift is not None:
        row |= {
            'dx': f'{shift.dx:.4f}', 'dy': f'{shift.dy:.4f}', 'response': f'{shift.response:.6f}'}
    if heading is not None:
        row |= {
            'heading_deg': f'{math.degrees(heading.heading):.4f}',
            'yaw_deg': f'{math.degrees(heading.yaw):.4f}', 'bridged': int(heading.bridged),
            'yaw_variance': f'{math.degrees(math.degrees(heading.variance)):.3e}'}
    if travel is not None:
        row['distance_state'] = travel.state.value
        if update.speed is not None:
            row |= {
                'distance': f'{travel.distance:.5f}',
                'distance_variance': f'{travel.variance:.3e}',
                'speed': f'{update.speed:.4f}',
                'speed_variance': f'{update.speed_variance:.3e}'}
    return row


def write_tum(poses: Iterable[tuple[int, Corner]], path: Path) -> None:
    """
    Write stamped corners in the TUM format, as lines ``stamp x y z qx qy qz qw``.

    REP 103 axes, in metres if they are known, else in camera heights or in unitless steps.
    """
    with path.open('w', encoding='utf-8') as file:
        for stamp_ns, tip in poses:
            half = tip.yaw / 2
            orientation = f'0 0 {math.sin(half):.6f} {math.cos(half):.6f}'
            file.write(f'{seconds_text(stamp_ns)} {tip.x:.9g} {tip.y:.9g} 0 {orientation}\n')


def seconds_text(nanoseconds: int) -> str:
    """Return seconds with all nine decimals: a float of the epoch would lose nanoseconds."""
    return f'{Decimal(nanoseconds).scaleb(-9):f}'
