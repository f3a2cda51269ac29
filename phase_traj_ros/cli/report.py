# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Shows progress, and prints codes, turns and distances, and what speaks against them."""

from collections.abc import Iterable, Sequence
import sys
from typing import Any

from phase_traj_ros.cli.escaping import escaped, screen
from phase_traj_ros.core import CodeSeries, Turn
from phase_traj_ros.io.replay.run import Replay
from phase_traj_ros.io.sources.base import Entry
from phase_traj_ros.tasks.batch.job import Through
from tqdm import tqdm

BY_SOURCE = '{desc}: {percentage:3.0f}%|{bar}| {n:.1f} of {total} [{elapsed}<{remaining}]'
"""Layout of a bar that counts sources in fractions."""

# What is printed of a long drive; chain_code.json has all of it.
_MOST_TURNS, _MOST_RUNS = 12, 50


def progress(
    items: Iterable[Any] | None = None, *, total: int | None, title: str,
    layout: str | None = None,
) -> Any:
    """
    Return a tqdm bar over ``items``, or one to advance by hand with ``update``.

    It is shown on a terminal only.
    """
    return tqdm(
        items, total=total, desc=escaped(title), unit=' frames', leave=False, disable=None,
        file=screen(), bar_format=layout)


def over_passes(*, total: int | None, title: str) -> Through:
    """Return what shows a bar over the frames of each pass of a replay."""
    def shown(frames: Iterable[Entry], which: str) -> Iterable[Entry]:
        name = f'{title}, {which}' if which else title
        bar: Iterable[Entry] = progress(frames, total=total, title=name)
        return bar
    return shown


def print_result(result: Replay) -> None:
    """Print codes, turns, camera and distance."""
    _print_series('movement ', result.codes.movement)
    _print_series('direction', result.codes.direction)
    _print_turns(result.turns)
    print_camera(result)
    _print_way(result)


def print_camera(result: Replay) -> None:
    """Print the camera in use, and what is used of its mount."""
    if result.camera is not None:
        print(f'camera: {result.camera}')
    if str(result.mounting):
        print(result.mounting)


def print_doubts(result: Replay) -> None:
    """
    Print why a result is not reliable.

    Warnings about the settings and the data go to the standard error.
    """
    if not result.reliability.reliable:
        print('not reliable:', *(reason.sentence for reason in result.reliability.reasons))
    if result.threshold_hint is not None:
        print(f'hint: {result.threshold_hint.sentence}')
    for warning in result.warnings:
        warn(warning)


def warn(warning: str) -> None:
    """Print a warning to the standard error."""
    print(f'warning: {warning}', file=sys.stderr)


def turn_words(angle_deg: float) -> str:
    """Return the side and the degrees of a turn."""
    return f'{"left" if angle_deg > 0 else "right"} {abs(angle_deg):.0f}'


def _print_turns(turns: Sequence[Turn]) -> None:
    """Print the angles of the first turns."""
    angles = [turn_words(turn.angle_deg) for turn in turns[:_MOST_TURNS]]
    more = ['...'] if len(turns) > _MOST_TURNS else []
    if angles:
        print(f'turns     ({len(turns)}): {", ".join(angles + more)} (degrees)')


def _print_way(result: Replay) -> None:
    """Print the distance, how it was measured, and the equal links; nothing without a distance."""
    way, links, unit = result.way, result.links, result.parameters.settings.length_unit.value
    if way.pairs:
        states = ', '.join(
            f'{count} {state.value}' for state, count in way.states.items() if count)
        doubt = ' for the assumed camera' if result.assumes_camera else ''
        known = 'unknown' if way.distance is None else f'{way} {unit}{doubt}'
        print(f'distance: {known} (pairs: {states})')
    if links is not None:
        _print_series(f'links of {links.step:g} {unit}', links.series)


def _print_series(name: str, series: CodeSeries[Any]) -> None:
    """Print codes in run-length form."""
    runs = [f'{int(run.code)}x{run.count}' for run in series.runs]
    more = ['...'] if len(runs) > _MOST_RUNS else []
    print(f'{name} ({len(series)}):', *runs[:_MOST_RUNS], *more)
