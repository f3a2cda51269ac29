# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Options for slow machines: the time they save, and their cost in accuracy."""

from __future__ import annotations

from benchmarks.shared.clips import Clip, kitti_clip, rendered_clip
from benchmarks.shared.report import paragraphs, table
from benchmarks.shared.timing import prepare, take_turns, Timed
import cv2
import numpy as np
from phase_traj_ros.core import EstimatorSettings, TrajectoryEstimator, View
from phase_traj_ros.synthetic import KITTI_CAMERA

_TURN_THRESHOLD = 20.0
_PERIOD_NS = 10 ** 8

INTRODUCTION = paragraphs("""
    These tables run the whole estimator by the paper's rule, with several settings on the same
    frames. The error is that of the yaw per pair, atan(dx / focal length) against the truth, in
    degrees: the median and the 95th percentile. The turns are those counted at T = 20 px. All
    shifts are in pixels of the full image.
    """)

OPTIONS = {
    "the paper's rule": View(),
    **{f'decimation {factor}': View(decimation=factor) for factor in (2, 3, 4)},
    '2 threads': View(),
}


def measure() -> dict[str, dict[str, tuple[Timed, np.ndarray, int]]]:
    """Return, by clip and option, the times, the errors in degrees and the number of turns."""
    clips = [kitti_clip('00'), rendered_clip(KITTI_CAMERA, first=0, count=140)]
    return {clip.name: _measure(clip) for clip in clips if clip is not None}


def _measure(clip: Clip) -> dict[str, tuple[Timed, np.ndarray, int]]:
    estimators = {
        name: TrajectoryEstimator(EstimatorSettings(threshold=_TURN_THRESHOLD, view=view))
        for name, view in OPTIONS.items()}

    def step(name):
        def update(item):
            index, frame = item
            cv2.setNumThreads(2 if 'threads' in name else 1)
            result = estimators[name].update(frame, index * _PERIOD_NS)
            cv2.setNumThreads(1)
            return result
        return update

    timed = take_turns(
        {name: step(name) for name in OPTIONS}, enumerate(clip.frames), warm_up=1)
    truth = np.degrees(np.diff(np.unwrap(clip.yaw)))
    measured = {}
    for name, times in timed.items():
        yaw = np.degrees(np.arctan([each.shift.dx / clip.camera.focal for each in times.results]))
        turns = sum(each.step.movement in (0, 2) for each in times.results)
        measured[name] = (times, np.abs(yaw - truth), turns)
    return measured


def section() -> str:
    """Run the measurement; return the section of the document."""
    parts = ['## Options for weaker machines', INTRODUCTION]
    for clip, measured in measure().items():
        plain = measured["the paper's rule"][0]
        parts.append(f'### {clip}')
        parts.append(table(
            ('option', 'ms', 'of the first', 'median error', '95 %', 'turns'),
            [(name, f'{times.ms:.2f}', f'{times.ms / plain.ms:.2f}×', f'{np.median(error):.3f}°',
              f'{np.quantile(error, 0.95):.3f}°', turns)
             for name, (times, error, turns) in measured.items()]))
    return '\n\n'.join(parts)


if __name__ == '__main__':
    prepare()
    print(section())
