# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of results, drawn with matplotlib and without a display."""

from __future__ import annotations

from collections.abc import Sequence
import math
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Axes, Movement, normalised, Shift, to_axes
from phase_traj_ros.core.codes.codes import Code
from phase_traj_ros.errors import OutputError
from phase_traj_ros.io.images.decoding import GreyImage
from phase_traj_ros.io.replay.overview import extremes, outline, Overview, overview, TurnMark
from phase_traj_ros.io.replay.run import Replay
from phase_traj_ros.io.results.palette import LIGHT

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Plot
    from matplotlib.figure import Figure

_DPI = 150
_SETTINGS = Lock()
# Turns that get a number.
_NUMBERED = 40
# Number of dots above which an SVG stores them as pixels.
_MANY = 2000
# Of a picture; further values are not seen, but take matplotlib's memory.
_COLUMNS = 2000
# Tolerance of a drawn path, as a share of its size.
_PATH_DETAIL = 1 / 4000


def write_trajectory_picture(result: Replay, path: Path) -> None:
    """
    Draw the normalised trajectory, and the shift and both codes over time (as in the paper).

    The turns are numbered and shaded. The shift is drawn with lines at +T and -T. ``path`` is the
    output file, .png or .svg.
    """
    shown = overview(result)
    rows = ['shift', 'movement', 'direction', *['heading'] * (shown.heading_deg is not None)]
    width, height = 12.0, 2.0 + 1.3 * len(rows)
    # All labels have a known size; to measure them takes as long as to draw the picture.
    figure = new_figure(width, height, fits_labels=False)
    margins = {
        'left': 0.55 / width, 'right': 1.0 - 0.3 / width, 'bottom': 0.5 / height,
        'top': 1.0 - 0.3 / height, 'wspace': 0.25, 'hspace': 0.24}
    plots = figure.subplot_mosaic(
        [['path', row] for row in rows], width_ratios=(1, 1.5),
        height_ratios=(1.5, *[1] * (len(rows) - 1)), gridspec_kw=margins)
    # With more numbers, they overlap.
    numbered = shown.turns[::math.ceil(len(shown.turns) / _NUMBERED) or 1]
    _draw_trajectory(plots.pop('path'), shown.path, numbered)
    _draw_shift(plots['shift'], shown, result.parameters.settings.threshold_set)
    _draw_codes(plots['movement'], shown.seconds, result.movement, Movement, 'movement')
    appended = [update.step.appended for update in result.updates]
    _draw_codes(
        plots['direction'], shown.seconds[appended], result.direction, result.codes.directions,
        'direction')
    if shown.heading_deg is not None:
        _draw_curve(plots['heading'], shown.seconds, shown.heading_deg)
        _title(plots['heading'], 'heading (degrees, left positive)')
    for mark in numbered:
        plots['shift'].annotate(
            str(mark.number), ((mark.start_s + mark.end_s) / 2, 0.97),
            xycoords=('data', 'axes fraction'), ha='center', va='top', fontsize=8,
            color=LIGHT.line)
    for row, plot in plots.items():
        if row != 'shift':
            plot.sharex(plots['shift'])
        for mark in shown.turns:
            plot.axvspan(mark.start_s, mark.end_s, color=LIGHT.line, alpha=0.10, linewidth=0)
        plot.tick_params(labelbottom=row == rows[-1], labelsize=8)
    plots[rows[-1]].set_xlabel('seconds since the first frame', fontsize=9)
    save(figure, path)


def save(figure: Figure, path: Path) -> None:
    """
    Write a figure in the format of its suffix; equal figures give equal bytes.

    Raises OutputError if matplotlib has no such format.
    """
    from matplotlib import rc_context
    kind = path.suffix[1:].lower() or 'png'
    if kind not in figure.canvas.get_supported_filetypes():
        raise OutputError(
            f'{path.name} is not the name of a picture: end it in .png, .svg or .pdf')
    # Settings of matplotlib are global to the process, and workers of a cluster may be threads.
    with _SETTINGS, rc_context({'svg.hashsalt': 'phase_traj'}):
        figure.savefig(
            path, dpi=_DPI, format=kind, metadata={'Date': None} if kind == 'svg' else None)


def write_correlation_picture(
    first: GreyImage, second: GreyImage, correlation: NDArray[np.float32], shift: Shift,
    path: Path,
) -> None:
    """Draw two frames and their correlation map with its peak (the paper's figure 2)."""
    figure = new_figure(9, 9)
    plots = figure.subplots(3, 1)
    for plot, image, title in ((plots[0], first, 'A'), (plots[1], second, 'B')):
        plot.imshow(image, cmap='gray')
        plot.set_title(title, loc='left', fontsize=9)
        plot.set_axis_off()
    rows, columns = correlation.shape
    extent = (-columns / 2 - 0.5, columns / 2 - 0.5, rows / 2 - 0.5, -rows / 2 - 0.5)
    # Most of the map is noise around zero and the peak is one pixel: a square root shows both.
    drawn = plots[2].imshow(
        np.sqrt(np.maximum(correlation, 0)), cmap='magma', extent=extent,
        interpolation='nearest')
    plots[2].plot(
        shift.dx, shift.dy, 'o', markersize=14, markerfacecolor='none',
        markeredgecolor=LIGHT.accent)
    plots[2].set_title(
        f'correlation map: dx {shift.dx:+.2f} px, dy {shift.dy:+.2f} px,'
        f' response {shift.response:.3f}', loc='left', fontsize=9)
    plots[2].set_xlabel('dx (px)')
    plots[2].set_ylabel('dy (px)')
    figure.colorbar(drawn, ax=plots[2], shrink=0.8, label='square root of r')
    save(figure, path)


def new_figure(width: float, height: float, *, fits_labels: bool = True) -> Figure:
    """
    Return an empty figure of ``width`` x ``height`` inches that does not need a display.

    ``fits_labels`` is whether its plots leave room for their labels, which are measured.
    """
    # Not imported earlier: it takes 30 MB, and the frames are gone when it is used.
    from matplotlib.figure import Figure
    return Figure(figsize=(width, height), layout='constrained' if fits_labels else None)


def write_path_picture(points: NDArray[np.float64], path: Path) -> None:
    """Draw a trajectory only; its vertices (n, 2) are in REP 103 axes."""
    figure = new_figure(5, 5)
    _draw_trajectory(figure.add_subplot(), points)
    save(figure, path)


def draw_path(
    plot: Plot, points: NDArray[np.float64], line: NDArray[np.float64], title: str,
) -> None:
    """Draw a path (n, 2) as a line (m, 2), with its start and end, in the axes of figures."""
    plot.plot(line[:, 0], line[:, 1], color=LIGHT.line, linewidth=2, solid_capstyle='round')
    plot.plot(*points[0], 'o', color=LIGHT.ink, label='start')
    plot.plot(*points[-1], 's', color=LIGHT.accent, label='end')
    plot.set_aspect('equal', adjustable='datalim')
    _title(plot, title)
    plot.grid(color=LIGHT.muted, alpha=0.3)
    plot.tick_params(labelsize=8)
    plot.margins(0.15)


def _draw_trajectory(
    plot: Plot, path: NDArray[np.float64], turns: Sequence[TurnMark] = (),
) -> None:
    """Draw a normalised path (n, 2) in REP 103 axes, its start heading up."""
    points = normalised(to_axes(path, Axes.FIGURE))
    draw_path(
        plot, points, outline(points, _PATH_DETAIL), 'trajectory, normalised, start heading up')
    plot.legend(frameon=False, fontsize=8)
    for mark in turns:
        # The vertex at which the first step in the new direction starts.
        plot.annotate(
            str(mark.number), points[mark.pair], fontsize=8, color='white', ha='center',
            va='center', zorder=5,
            bbox={'boxstyle': 'circle,pad=0.25', 'facecolor': LIGHT.line, 'edgecolor': 'white'})


def _draw_shift(plot: Plot, shown: Overview, threshold: float | None) -> None:
    plot.axhline(0, color=LIGHT.muted, linewidth=0.6)
    title = 'shift (px per frame, positive in a left turn)'
    if threshold is not None:
        title += f', T = {threshold:.3g}'
        for side, sign in ((1, '+'), (-1, '−')):
            plot.axhline(side * threshold, color=LIGHT.accent, linewidth=0.9, linestyle='--')
            plot.annotate(
                f'{sign}T', (1.005, side * threshold), xycoords=('axes fraction', 'data'),
                color=LIGHT.accent, fontsize=8, va='center')
    _draw_curve(plot, shown.seconds, shown.dx)
    # Space for the numbers of the turns.
    plot.margins(y=0.16)
    _title(plot, title)


def _draw_curve(plot: Plot, seconds: NDArray[np.float64], values: NDArray[np.float64]) -> None:
    seen = extremes(values, _COLUMNS)
    plot.plot(seconds[seen], values[seen], color=LIGHT.line, linewidth=1)
    # An exponent would overlap the title.
    plot.ticklabel_format(axis='y', style='plain', useOffset=False)
    plot.grid(axis='y', color=LIGHT.muted, alpha=0.3)


def _draw_codes(
    plot: Plot, seconds: NDArray[np.float64], codes: Sequence[int], kind: type[Code], title: str,
) -> None:
    names = [f'{code.label} {int(code)}' for code in sorted(kind)]
    values = np.asarray(codes)
    many = len(values) > _MANY
    # Of each column, one dot for each code.
    columns = np.arange(len(values)) * _COLUMNS // max(len(values), _COLUMNS)
    seen = np.sort(np.unique(len(names) * columns + values, return_index=True)[1])
    seconds, values = seconds[seen], values[seen]
    plot.step(seconds, values, where='post', color=LIGHT.muted, linewidth=0.8, rasterized=many)
    # An SVG has one element per dot.
    plot.scatter(seconds, values, s=7, color=LIGHT.line, zorder=3, rasterized=many)
    plot.set_yticks(range(len(names)), names)
    plot.set_ylim(-0.4, len(names) - 0.6)
    plot.grid(axis='y', color=LIGHT.muted, alpha=0.3)
    _title(plot, f'{title}: {len(codes)} codes')


def _title(plot: Plot, text: str) -> None:
    # With a fixed height, matplotlib does not measure the labels, which is slow.
    plot.set_title(text, loc='left', fontsize=9, y=1.0)
