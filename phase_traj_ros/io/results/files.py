# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes the results of a replay as JSON, CSV, TUM and a picture."""

from collections.abc import Iterable
import csv
from dataclasses import asdict
from decimal import Decimal
from itertools import chain
import math
from pathlib import Path
from typing import Any

import numpy as np
from phase_traj_ros.core import Corner, Direction, pack, Update
from phase_traj_ros.io.replay.run import Replay
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
from phase_traj_ros.io.results.figures import write_trajectory_picture

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


def write_chain_code(result: Replay, path: Path) -> None:
    """Write codes, turns and camera as JSON; docs/reference/files.md describes the keys."""
    content: dict[str, Any] = {
        'source': result.source,
        'frames': result.frames,
        'threshold': result.parameters.settings.threshold_set,
        'movement': [int(code) for code in result.movement],
        'direction': [int(code) for code in result.direction],
        'movement_runs': run_pairs(result.codes.movement.runs),
        'direction_runs': run_pairs(result.codes.direction.runs),
        'movement_packed': pack(result.movement).hex(),
        **({'direction_packed': pack(result.direction).hex()}
           if result.codes.directions is Direction else {}),
        'status': [update.status.value for update in result.updates],
        **reliability_content(result.reliability),
        'cuts': [update.pair for update in result.updates if update.cut],
        **_heading_content(result),
        **mount_content(result.mounting),
        'path_unit': result.path_unit.value,
        'frame_numbers': None if result.frame_numbers is None else list(result.frame_numbers),
        'source_frames': asdict(result.source_frames),
        'first_stamp_ns': result.first_stamp_ns,
        'last_stamp_ns': result.updates[-1].stamp_ns,
        'dropped_frames': result.counters.dropped,
        'skipped_frames': result.counters.skipped,
        'repeated_frames': result.counters.repeated,
        'time_resets': result.counters.time_resets,
        'versions': versions(),
        **way_content(result.way, result.links, unit=result.parameters.settings.length_unit),
    }
    if result.links is not None:
        content['links'] = [int(code) for code in result.links.series]
    write_json(content, path)


def _heading_content(result: Replay) -> dict[str, Any]:
    """Return heading, turns and camera; empty if the heading is not measured."""
    headings = np.fromiter((
        (update.heading.heading, update.heading.bridged)
        for update in result.updates if update.heading is not None),
        np.dtype((np.float64, 2)))
    if not len(headings):
        return {}
    return {
        'code_source': result.parameters.settings.code_source.value,
        'connectivity': result.parameters.connectivity,
        'path_from': result.parameters.settings.drawn_from.value,
        'focal_px': result.focal_px,
        'camera': camera_content(result.camera),
        'speed': result.parameters.speed,
        'heading_deg': [
            0.0, *(round(each, 4) for each in np.degrees(headings[:, 0]).tolist())],
        'bridged_share': float(headings[:, 1].mean()),
        'turns': turn_list(result.turns),
        'field_of_view': None if result.field_of_view is None else asdict(result.field_of_view),
    }


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
