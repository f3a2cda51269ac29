# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes chain_code.json, of which a replay and the node have many parts in common."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from enum import Enum
import json
import math
from pathlib import Path
import platform
from typing import Any

import cv2
import numpy as np
import phase_traj_ros
from phase_traj_ros.core import (
    Direction,
    EstimatorSettings,
    Movement,
    pack,
    PairStatus,
    Run,
    TrajectoryEstimator,
)
from phase_traj_ros.core.correlation.transforms import find_transform
from phase_traj_ros.core.heading.turns import Turn
from phase_traj_ros.core.reliability.verdict import Reliability
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.replay.run import Replay


def write_chain_code(result: Replay, path: Path) -> None:
    """Write codes, turns and camera as JSON; docs/reference/files.md describes the keys."""
    write_json({
        **_common(
            result, result.mounting, result.parameters.settings, result.reliability,
            source=result.source),
        'movement': result.movement,
        'direction': result.direction,
        'movement_packed': pack(result.movement).hex(),
        **({'direction_packed': pack(result.direction).hex()}
           if result.codes.directions is Direction else {}),
        'status': [update.status for update in result.updates],
        'cuts': [update.pair for update in result.updates if update.cut],
        **_heading_content(result),
        'frame_numbers': None if result.frame_numbers is None else list(result.frame_numbers),
        'source_frames': result.source_frames,
        'first_stamp_ns': result.first_stamp_ns,
        'last_stamp_ns': result.updates[-1].stamp_ns,
        'dropped_frames': result.counters.dropped,
        'skipped_frames': result.counters.skipped,
        'repeated_frames': result.counters.repeated,
        'time_resets': result.counters.time_resets,
        **({} if result.links is None else {'links': list(result.links.series)}),
    }, path)


def _heading_content(result: Replay) -> dict[str, Any]:
    """Return heading, turns and camera; empty if the heading is not measured."""
    headings = np.fromiter((
        (update.heading.heading, update.heading.bridged,
         update.status is not PairStatus.REPEATED and update.heading.foreseen == 0.0)
        for update in result.updates if update.heading is not None),
        np.dtype((np.float64, 3)))
    if not len(headings):
        return {}
    return {
        'code_source': result.parameters.settings.code_source,
        'connectivity': result.parameters.connectivity,
        'path_from': result.parameters.settings.drawn_from,
        'focal_px': result.camera and result.camera.focal_px,
        'camera': result.camera,
        'speed': result.parameters.speed,
        'heading_deg': [0.0, *(round(each, 4) for each in np.degrees(headings[:, 0]).tolist())],
        'bridged_share': float(headings[:, 1].sum() / max(headings[:, 2].sum(), 1.0)),
        'turns': _turn_list(result.turns),
        'field_of_view': result.field_of_view,
    }


def chain_code_of(
    estimator: TrajectoryEstimator, mounting: Mounting, *, source: str,
) -> dict[str, Any]:
    """Return what is known while a drive goes on; the runs are as many as are kept."""
    codes, settings, heading = estimator.codes, estimator.settings, estimator.heading
    return {
        **_common(
            estimator, mounting, settings, estimator.reliability.of_drive, source=source),
        'code_source': settings.code_source,
        'connectivity': settings.connectivity,
        'path_from': settings.drawn_from,
        'movement_totals': codes.movement.totals_of(Movement),
        'direction_totals': codes.direction.totals_of(codes.directions),
        'counters': asdict(estimator.counters),
        'turns': _turn_list(estimator.turns),
        **({} if heading is None else {
            'heading_deg': math.degrees(heading.tracker.heading),
            'bridged_share': heading.tracker.bridged_share,
            'focal_px': heading.camera.focal_px,
            'field_of_view': heading.camera.field_of_view,
            'camera': heading.camera.in_use}),
    }


def _common(
    drive: Replay | TrajectoryEstimator, mounting: Mounting, settings: EstimatorSettings,
    found: Reliability, *, source: str,
) -> dict[str, Any]:
    """Return what a replay and the node have in common."""
    way, links = drive.way, drive.links
    content: dict[str, Any] = {
        'source': source,
        'frames': drive.frames,
        'threshold': settings.threshold_set,
        'movement_runs': _pairs(drive.codes.movement.runs),
        'direction_runs': _pairs(drive.codes.direction.runs),
        'path_unit': settings.path_unit(measured=way.measured),
        'reliable': found.reliable,
        'reasons': found.reasons,
        'unreliable_spans': [
            {'start': span.start_ns / 1e9, 'end': span.end_ns / 1e9, 'reasons': span.reasons}
            for span in found.spans],
        'versions': versions()}
    if mounting.mount is not None:
        content['mount'] = {**asdict(mounting.mount), 'found': dict(mounting.found)}
    if way.pairs:
        content |= {
            'distance': None if way.distance is None else round(way.distance, 4),
            'distance_unit': settings.length_unit,
            'distance_states': {state.value: count for state, count in way.states.items()}}
    if links is not None:
        content |= {
            'code_step': links.step,
            'code_step_unit': settings.length_unit,
            'links_runs': _pairs(links.series.runs),
            'links_totals': links.series.totals_of(links.directions)}
    return content


def _turn_list(turns: Iterable[Turn]) -> list[dict[str, float]]:
    """Return turns in the form of the files: times in seconds, angles in degrees."""
    return [
        {
            'start_frame': turn.start_frame,
            'end_frame': turn.end_frame,
            'start': turn.start_ns / 1e9,
            'end': turn.end_ns / 1e9,
            'angle_deg': round(turn.angle_deg, 3),
            'peak_rate_deg_s': round(turn.peak_rate_deg_s, 3),
            'quarter_turns': turn.quarter_turns,
        }
        for turn in turns]


def versions() -> dict[str, str]:
    """Return the versions on which results depend, with the library of the transforms."""
    return {
        'phase_traj_ros': phase_traj_ros.__version__,
        'python': platform.python_version(),
        'numpy': np.__version__,
        'opencv': cv2.__version__,
        'transforms': find_transform().name,
    }


def write_json(content: Mapping[str, object], path: Path) -> None:
    """Write an object as JSON, one line per key, so that long lists stay readable."""
    lines = ',\n'.join(
        f'  {json.dumps(key)}: {json.dumps(value, default=_plain)}'
        for key, value in content.items())
    path.write_text(f'{{\n{lines}\n}}\n', encoding='utf-8')


def _pairs(runs: Sequence[Run[Any]]) -> list[tuple[int, int]]:
    """Return runs as (code, count)."""
    return [(run.code, run.count) for run in runs]


def _plain(value: Any) -> Any:
    """Return a value of an enumeration or a dataclass in the form of the files."""
    return value.value if isinstance(value, Enum) else asdict(value)
