# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The parts of chain_code.json that a replay and the node have in common."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
import json
from pathlib import Path
import platform
from typing import Any

import cv2
import numpy as np
import phase_traj_ros
from phase_traj_ros.core import CameraInUse, LengthUnit, LinkCode, Run, Way
from phase_traj_ros.core.correlation.transforms import find_transform
from phase_traj_ros.core.heading.turns import Turn
from phase_traj_ros.core.reliability.verdict import Reliability
from phase_traj_ros.io.messages.mounting import Mounting


def way_content(way: Way, links: LinkCode | None, *, unit: LengthUnit) -> dict[str, Any]:
    """Return distance and equal links in the form of the files, as far as there are any."""
    content: dict[str, Any] = {}
    if way.pairs:
        content = {
            'distance': round(way.distance, 4),
            'distance_unit': unit.value,
            'distance_states': {state.value: count for state, count in way.states.items()}}
    if links is not None:
        content |= {
            'code_step': links.step,
            'code_step_unit': unit.value,
            'links_runs': run_pairs(links.series.runs),
            'links_totals': links.series.totals_of(links.directions)}
    return content


def reliability_content(found: Reliability) -> dict[str, Any]:
    """Return the reliability of a result in the form of the files."""
    return {
        'reliable': found.reliable,
        'reasons': list(found.words),
        'unreliable_spans': [
            {'start': span.start_ns / 1e9, 'end': span.end_ns / 1e9,
             'reasons': [reason.value for reason in span.reasons]} for span in found.spans],
    }


def camera_content(camera: CameraInUse | None) -> dict[str, Any] | None:
    """Return the camera in use in the form of the files; None if there is none."""
    return None if camera is None else {**asdict(camera), 'origin': camera.origin.value}


def mount_content(mounting: Mounting) -> dict[str, Any]:
    """Return the mount of the camera in the form of the files, if it is known."""
    if mounting.mount is None:
        return {}
    return {'mount': {**asdict(mounting.mount), 'found': dict(mounting.found)}}


def turn_list(turns: Iterable[Turn]) -> list[dict[str, float]]:
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
        f'  {json.dumps(key)}: {json.dumps(value)}' for key, value in content.items())
    path.write_text(f'{{\n{lines}\n}}\n', encoding='utf-8')


def run_pairs(runs: Sequence[Run[Any]]) -> list[tuple[int, int]]:
    """Return runs as (code, count)."""
    return [(int(run.code), run.count) for run in runs]
