# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The effect of the tests on the codes: how often the turns are correct."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from benchmarks.quality.curves import grouped, say
from benchmarks.quality.data import named, overlays
from benchmarks.shared.clips import Clip
from benchmarks.shared.report import paragraphs, table
import numpy as np
from phase_traj_ros.core import DynamicChainCode, Movement, PhaseCorrelator
from phase_traj_ros.core.correlation.quality import (
    GateSettings,
    PairQuality,
    Quality,
    StillnessSettings,
)

_THRESHOLDS = (16.0, 20.0)
# Seconds between the frames of all clips, for the tests.
_INTERVAL = 0.1
_CONDITIONS = ('as they are', 'noise, σ = 20', 'noise, σ = 50', 'night, 6 % of the light',
               'rain, 2000 streaks')

_TEXT = """
    The state machine tolerates the remaining wrong pairs: a turn counts at the
    `shift.confirm_frames`-th consecutive pair beyond the threshold, and ends at the
    `shift.release_frames`-th consecutive pair below it. A turn at a crossing exceeds the threshold
    for one or two seconds, so 2 and 4 pairs have no cost at 10 Hz; 3 pairs to confirm would miss
    turns of a 5 Hz camera. The table counts the drives whose turns are exactly the true ones, in
    order, at thresholds of 16 and 20 px. The true turns are those that the paper's state machine
    finds in the true yaw.
    """


@dataclass(frozen=True, slots=True)
class Way:
    """One set of settings."""

    tests: bool
    confirm_frames: int = 1
    release_frames: int = 1


_WAYS = {
    'paper': Way(tests=False),
    'waiting, 2 and 4': Way(tests=False, confirm_frames=2, release_frames=4),
    'tests': Way(tests=True),
    'tests, waiting 2 and 4': Way(tests=True, confirm_frames=2, release_frames=4),
    'tests, waiting 3 and 4': Way(tests=True, confirm_frames=3, release_frames=4),
}


@dataclass(frozen=True, slots=True)
class Score:
    """Whether the turns of one drive were correct with one set of settings."""

    condition: str
    way: str
    right: bool


def turns(
    shifts: Iterable[float | None], threshold: float, way: Way = _WAYS['paper'],
) -> list[Movement]:
    """Return the turns that the chain code finds in shifts in pixels; None is skipped."""
    codes = DynamicChainCode(
        threshold, confirm_frames=way.confirm_frames, release_frames=way.release_frames)
    steps = [codes.skip() if dx is None else codes.update(dx) for dx in shifts]
    return [step.movement for step in steps if step.movement in (Movement.LEFT, Movement.RIGHT)]


def followed(frames: Iterable[np.ndarray]) -> tuple[list[float], list[float | None]]:
    """Return the shifts as measured, and those that pass the tests."""
    correlator = PhaseCorrelator()
    tests = PairQuality(gate=GateSettings(), stillness=StillnessSettings())
    measured: list[float] = []
    judged: list[float | None] = []
    for frame in frames:
        shift = correlator.update(frame)
        tests.update(frame)
        if shift is not None:
            verdict, believed = tests.judge(shift, correlator, _INTERVAL)
            measured.append(shift.dx)
            judged.append(believed.dx if verdict is Quality.MEASURED else None)
    return measured, judged


def spoiled(clip: Clip, seed: int) -> Iterator[tuple[str, Callable[[], list[np.ndarray]]]]:
    """Yield the conditions, each with a function that makes its frames."""
    for condition in named(*_CONDITIONS):
        yield condition.name, lambda condition=condition: condition.spoil(clip, seed).frames
    for overlay in overlays(clip.shape, seed)[1:]:
        yield overlay.name, lambda overlay=overlay: [overlay.over(each) for each in clip.frames]


def measure(clips: Sequence[Clip]) -> list[Score]:
    """Return the scores of all settings on all drives under all conditions."""
    scores = []
    for seed, clip in enumerate(clips):
        true_shifts = (clip.camera.focal * np.tan(np.diff(clip.yaw))).tolist()
        for condition, make in spoiled(clip, seed):
            measured, judged = followed(make())
            for name, way in _WAYS.items():
                found = judged if way.tests else measured
                scores += [
                    Score(condition, name, turns(found, threshold, way) == turns(
                        true_shifts, threshold, _WAYS['paper']))
                    for threshold in _THRESHOLDS]
        say(f'turns, {clip.name}')
    return scores


def section(scores: Sequence[Score]) -> str:
    """Return the section of the document on turns."""
    rows = []
    for condition, group in grouped(scores, lambda score: score.condition).items():
        ways = grouped(group, lambda score: score.way)
        rows.append((condition, *(
            f'{sum(score.right for score in ways[way])}/{len(ways[way])}' for way in _WAYS)))
    return '\n\n'.join((
        '## Turns', paragraphs(_TEXT), table(('drives with the right turns', *_WAYS), rows)))
