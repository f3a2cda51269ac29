# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The figure of an evaluation: the drawn trajectory beside the true one, and the headings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Axes, LengthUnit, normalised, to_axes
from phase_traj_ros.io.results.figures import new_figure, save
from phase_traj_ros.io.results.palette import LIGHT
from phase_traj_ros.tasks.evaluation.evaluate import Evaluation, PathErrors
from phase_traj_ros.tasks.evaluation.ground_truth import MatchedTruth
from phase_traj_ros.tasks.evaluation.replayed_drive import ReplayedDrive
from phase_traj_ros.tasks.evaluation.scores import aligned, true_turns

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Plot


def write_evaluation_picture(
    drive: ReplayedDrive, true: MatchedTruth, evaluation: Evaluation, path: Path,
) -> None:
    """
    Draw the true trajectory and those drawn from the codes and from the heading, side by side.

    Each is normalised with its start heading up. The true one is drawn behind the others, at the
    best fit. A path in metres is also drawn in metres, with the true one at the best fit without
    scaling; a path in camera heights with the true one at the best fit. Below are both headings
    over time, and the spans of the true and the found turns.
    """
    by_heading = drive.drawn_from_heading()
    as_written = drive.path is not None and drive.unit is not LengthUnit.STEP
    columns = 4 if as_written else 3
    figure = new_figure(11 / 3 * columns, 6.5 if drive.heading is not None else 4)
    rows = 2 if drive.heading is not None else 1
    grid = figure.add_gridspec(rows, columns, height_ratios=(1.5, 1)[:rows])
    _draw_path(figure.add_subplot(grid[0, 0]), true.positions, 'true trajectory')
    shapes = evaluation.shape_error
    for column, (drawn, error, name) in enumerate((
            (drive.drawn_from_codes(), shapes.codes, 'codes'),
            (by_heading, shapes.heading, 'heading')), 1):
        if drawn is not None:
            note = '' if error is None else f', off by {error:.1%}'
            _draw_path(
                figure.add_subplot(grid[0, column]), drawn[true.frames],
                f'drawn from the {name}{note}', behind=true.positions)
    if drive.path is not None and as_written:
        plot, drawn = figure.add_subplot(grid[0, 3]), drive.path[true.frames]
        if drive.metric:
            _draw_in_metres(plot, drawn, true.positions, evaluation.path_errors)
        else:
            note = '' if shapes.path is None else f', off by {shapes.path:.1%}'
            _draw_path(plot, drawn, f'in {drive.unit.value}{note}', behind=true.positions)
    if drive.heading is not None:
        _draw_headings(figure.add_subplot(grid[1, :]), drive, true, drive.heading)
    save(figure, path)


def _draw_path(
    plot: Plot, points: NDArray[np.float64], title: str, *,
    behind: NDArray[np.float64] | None = None,
) -> None:
    """Draw a path (n, 2) in REP 103 axes; ``behind`` is fitted to it."""
    shown = to_axes(points, Axes.FIGURE)
    extent = max(float(np.ptp(shown, axis=0).max()), 1e-9)
    if behind is not None:
        fitted = (to_axes(aligned(behind, points), Axes.FIGURE) - shown[0]) / extent
        plot.plot(fitted[:, 0], fitted[:, 1], color=LIGHT.muted, linewidth=3, alpha=0.5)
    _draw_line(plot, normalised(shown), title)


def _draw_in_metres(
    plot: Plot, points: NDArray[np.float64], true: NDArray[np.float64], errors: PathErrors,
) -> None:
    """Draw a path (n, 2) and the true one, both in metres and at one scale."""
    shown = to_axes(points, Axes.FIGURE)
    fitted = to_axes(aligned(true, points, scaled=False), Axes.FIGURE)
    plot.plot(fitted[:, 0], fitted[:, 1], color=LIGHT.muted, linewidth=3, alpha=0.5)
    notes = [
        f'{name} {value:{form}} %' for name, value, form in (
            ('distance', errors.distance_error_percent, '+.1f'),
            ('t_rel', errors.t_rel_percent, '.1f')) if value is not None]
    _draw_line(plot, shown, ', '.join(['in metres', *notes]))


def _draw_line(plot: Plot, shown: NDArray[np.float64], title: str) -> None:
    plot.plot(shown[:, 0], shown[:, 1], color=LIGHT.line, linewidth=2, solid_capstyle='round')
    plot.plot(*shown[0], 'o', color=LIGHT.ink)
    plot.plot(*shown[-1], 's', color=LIGHT.accent)
    plot.set_aspect('equal', adjustable='datalim')
    plot.set_title(title, loc='left', fontsize=9)
    plot.grid(color=LIGHT.muted, alpha=0.3)
    plot.tick_params(labelsize=8)
    plot.margins(0.15)


def _draw_headings(
    plot: Plot, drive: ReplayedDrive, true: MatchedTruth, heading: NDArray[np.float64],
) -> None:
    begin = true.stamps_ns[0]
    seconds = (true.stamps_ns - begin) / 1e9
    measured = heading[true.frames] - heading[true.frames[0]]
    plot.plot(seconds, np.degrees(true.headings), color=LIGHT.muted, linewidth=3, label='true')
    plot.plot(seconds, np.degrees(measured), color=LIGHT.line, linewidth=1.2, label='measured')
    for turns, color, (low, high), name in (
            (true_turns(true), LIGHT.muted, (0.0, 0.03), 'true turns'),
            (drive.turns or (), LIGHT.accent, (0.03, 0.06), 'turns found')):
        for number, turn in enumerate(turns):
            plot.axvspan(
                (turn.start_ns - begin) / 1e9, (turn.end_ns - begin) / 1e9, low, high,
                color=color, linewidth=0, label=None if number else name)
    plot.set_title('heading (degrees, left positive)', loc='left', fontsize=9)
    plot.set_xlabel('seconds', fontsize=8)
    plot.grid(color=LIGHT.muted, alpha=0.3)
    plot.tick_params(labelsize=8)
    plot.legend(frameon=False, fontsize=8)
