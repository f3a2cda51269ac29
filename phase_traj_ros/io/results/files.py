# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes the results of a replay as JSON, CSV, TUM and a picture."""

from collections.abc import Iterable, Iterator
import csv
from dataclasses import asdict
from itertools import chain
import math
from pathlib import Path
from typing import Any

import numpy as np
from phase_traj_ros.core import Corner, Direction, pack, Update
from phase_traj_ros.core.heading.tracker import HeadingStep
from phase_traj_ros.io.replay.run import Replay
from phase_traj_ros.io.results.content import (
    camera_content,
    links_content,
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
    write_tum(result, directory / 'trajectory.tum')
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
        **_direction_packed(result),
        'status': [update.status.value for update in result.updates],
        **reliability_content(result.reliability),
        'cuts': [update.pair for update in result.updates if update.cut],
        **_heading_content(result),
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
        **way_content(result.way, unit=result.parameters.settings.length_unit),
        **links_content(result.links, unit=result.parameters.settings.length_unit),
    }
    if result.links is not None:
        content['links'] = [int(code) for code in result.links.series]
    write_json(content, path)


def _direction_packed(result: Replay) -> dict[str, str]:
    """Return the packed direction codes, two bits each; empty for eight directions."""
    if result.codes.directions is not Direction:
        return {}
    return {'direction_packed': pack(result.direction).hex()}


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
        'camera': None if result.camera is None else camera_content(result.camera),
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
        table = csv.writer(file, lineterminator='\n')
        table.writerow(CSV_COLUMNS)
        table.writerows(map(shift_row, result.updates))


def shift_row(update: Update) -> tuple[object, ...]:
    """
    Return the row of a pair of frames, see ``CSV_COLUMNS``.

    Stamps and intervals are in seconds, shifts in pixels. dx, dy and response are empty if the two
    frames could not be compared, the direction if none was appended. Heading and yaw are in
    degrees, positive to the left; ``bridged`` is 1 if the yaw was bridged, else 0. The three and
    the variance of the yaw, in square degrees, are empty if no heading is measured. Distance and
    speed are in metres, or in camera heights if no metres are known, with their variances and the
    state of the distance. The numbers are empty if the distance is unknown, all five if no
    distance is measured.
    """
    shift = update.shift
    measured = ('', '', '') if shift is None else (
        f'{shift.dx:.4f}', f'{shift.dy:.4f}', f'{shift.response:.6f}')
    return (
        update.pair, seconds_text(update.stamp_ns), seconds_text(update.interval_ns),
        *measured, int(update.step.movement),
        int(update.step.direction) if update.step.appended else '', update.status.value,
        *_heading_cells(update.heading), *_distance_cells(update),
        _yaw_variance(update.heading))


def _heading_cells(heading: HeadingStep | None) -> tuple[object, object, object]:
    if heading is None:
        return '', '', ''
    return (
        f'{math.degrees(heading.heading):.4f}', f'{math.degrees(heading.yaw):.4f}',
        int(heading.bridged))


def _yaw_variance(heading: HeadingStep | None) -> str:
    """Return the variance of the yaw in square degrees."""
    return '' if heading is None else f'{math.degrees(math.degrees(heading.variance)):.3e}'


def _distance_cells(update: Update) -> tuple[str, str, str, str, str]:
    travel, speed, variance = update.travel, update.speed, update.speed_variance
    if travel is None:
        return '', '', '', '', ''
    if speed is None or variance is None:
        return '', '', travel.state.value, '', ''
    return (
        f'{travel.distance:.5f}', f'{travel.variance:.3e}', travel.state.value, f'{speed:.4f}',
        f'{variance:.3e}')


def write_tum(result: Replay, path: Path) -> None:
    """Write the drawn trajectory in the TUM format, one pose per frame; see ``tum_lines``."""
    first = (result.first_stamp_ns, Corner(0, 0, 0.0, result.first_stamp_ns))
    with path.open('w', encoding='utf-8') as file:
        file.writelines(tum_lines(
            chain([first], ((update.stamp_ns, update.tip) for update in result.updates))))


def tum_lines(poses: Iterable[tuple[int, Corner]]) -> Iterator[str]:
    """
    Yield stamped corners as lines ``stamp x y z qx qy qz qw``.

    REP 103 axes, in metres if they are known, else in camera heights or in unitless steps.
    """
    for stamp_ns, tip in poses:
        half = tip.yaw / 2
        orientation = f'0 0 {math.sin(half):.6f} {math.cos(half):.6f}'
        yield f'{seconds_text(stamp_ns)} {tip.x:.9g} {tip.y:.9g} 0 {orientation}\n'


def seconds_text(nanoseconds: int) -> str:
    """Return seconds with all nine decimals: a float of the epoch would lose nanoseconds."""
    sign = '-' if nanoseconds < 0 else ''
    seconds, rest = divmod(abs(nanoseconds), 10**9)
    return f'{sign}{seconds}.{rest:09d}'
