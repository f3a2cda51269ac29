# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The figure of an evaluation: the drawn trajectory beside the true one, and the headings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Axes, LengthUnit, to_axes
from phase_traj_ros.io.results.figures import draw_path, new_figure, save
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
    Draw the paths from the codes and from the heading, with the true one at the best fit.

    A path in metres or in camera heights takes the place of that from the heading. In metres, the
    fit does not scale. Below are both headings over time, and the spans of the true and the found
    turns.
    """
    shapes, by_heading = evaluation.shape_error, drive.drawn_from_heading()
    drawn = [('drawn from the codes', drive.drawn_from_codes(), shapes.codes)]
    if drive.path is not None and drive.unit is not LengthUnit.STEP:
        unit = 'metres' if drive.metric else drive.unit.value
        drawn.append((f'in {unit}', drive.path, shapes.path))
    elif by_heading is not None:
        drawn.append(('drawn from the heading', by_heading, shapes.heading))
    rows = 1 if drive.heading is None else 2
    figure = new_figure(5.5 * len(drawn), 6.5 if rows > 1 else 4)
    grid = figure.add_gridspec(rows, len(drawn), height_ratios=(1.5, 1)[:rows])
    for column, (name, points, error) in enumerate(drawn):
        in_metres = drive.metric and column > 0
        notes = _metric_notes(evaluation.path_errors) if in_metres else (
            [] if error is None else [f'off by {error:.1%}'])
        plot, found = figure.add_subplot(grid[0, column]), points[true.frames]
        fitted = to_axes(aligned(true.positions, found, scaled=not in_metres), Axes.FIGURE)
        plot.plot(fitted[:, 0], fitted[:, 1], color=LIGHT.muted, linewidth=3, alpha=0.5)
        shown = to_axes(found, Axes.FIGURE)
        draw_path(plot, shown, shown, ', '.join([name, *notes]))
    if drive.heading is not None:
        _draw_headings(figure.add_subplot(grid[1, :]), drive, true, drive.heading)
    save(figure, path)


def _metric_notes(errors: PathErrors) -> list[str]:
    return [
        f'{name} {value:{form}} %' for name, value, form in (
            ('distance', errors.distance_error_percent, '+.1f'),
            ('t_rel', errors.t_rel_percent, '.1f')) if value is not None]


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
