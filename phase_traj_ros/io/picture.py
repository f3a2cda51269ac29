# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of results, drawn with matplotlib and without a display."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Axes, Direction, Movement, normalised, Shift, to_axes, vertices
from phase_traj_ros.errors import MissingDependencyError
from phase_traj_ros.io.decoding import GreyImage
from phase_traj_ros.io.replay import Replay

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Plot
    from matplotlib.figure import Figure

_INK = '#1f2933'
_PATH = '#0b6e99'
_ACCENT = '#d1495b'
_MUTED = '#9aa5b1'
_DPI = 150


def write_trajectory_picture(result: Replay, path: Path) -> None:
    """Draw the paper's figure: the normalised trajectory, and both codes over time."""
    figure = new_figure(11, 5)
    grid = figure.add_gridspec(2, 2, width_ratios=(1, 1.6), hspace=0.12, wspace=0.22)
    _draw_trajectory(
        figure.add_subplot(grid[:, 0]), vertices(result.direction, axes=Axes.FIGURE))
    seconds = [(update.stamp_ns - result.first_stamp_ns) / 1e9 for update in result.updates]
    movement = figure.add_subplot(grid[0, 1])
    _draw_codes(movement, seconds, result.movement, _names(Movement))
    movement.set_title(f'movement: {len(result.movement)} codes', loc='left', fontsize=9)
    movement.tick_params(labelbottom=False)
    direction = figure.add_subplot(grid[1, 1], sharex=movement)
    appended = [index for index, update in enumerate(result.updates) if update.step.appended]
    _draw_codes(
        direction, [seconds[index] for index in appended], result.direction, _names(Direction))
    direction.set_title(f'direction: {len(result.direction)} codes', loc='left', fontsize=9)
    direction.set_xlabel('seconds since the first frame')
    figure.savefig(path, dpi=_DPI, format=path.suffix[1:])


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
    # Most of the map is noise about zero and the peak is one pixel: a square root shows both.
    drawn = plots[2].imshow(
        np.sqrt(np.maximum(correlation, 0)), cmap='magma', extent=extent,
        interpolation='nearest')
    plots[2].plot(
        shift.dx, shift.dy, 'o', markersize=14, markerfacecolor='none', markeredgecolor=_ACCENT)
    plots[2].set_title(
        f'correlation map: dx {shift.dx:+.2f} px, dy {shift.dy:+.2f} px,'
        f' response {shift.response:.3f}', loc='left', fontsize=9)
    plots[2].set_xlabel('dx (px)')
    plots[2].set_ylabel('dy (px)')
    figure.colorbar(drawn, ax=plots[2], shrink=0.8, label='square root of r')
    figure.savefig(path, dpi=_DPI, format=path.suffix[1:] or 'png')


def require_matplotlib() -> None:
    """
    Find out before the work whether pictures can be drawn after it.

    Raises
    ------
    MissingDependencyError
        matplotlib is not installed.

    """
    new_figure(1, 1)


def new_figure(width: float, height: float) -> Figure:
    """
    Return an empty figure of ``width`` x ``height`` inches that needs no display.

    Raises
    ------
    MissingDependencyError
        matplotlib is not installed.

    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingDependencyError(
            'pictures need matplotlib: install python3-matplotlib (apt) or matplotlib (pip)',
        ) from None
    return Figure(figsize=(width, height), layout='constrained')


def write_path_picture(points: NDArray[np.float64], path: Path) -> None:
    """Draw a trajectory alone; its vertices (n, 2) are in REP 103 axes."""
    figure = new_figure(5, 5)
    _draw_trajectory(figure.add_subplot(), to_axes(points, Axes.FIGURE))
    figure.savefig(path, dpi=_DPI, format=path.suffix[1:])


def _draw_trajectory(plot: Plot, vertices_in_figure: NDArray[np.float64]) -> None:
    points = normalised(vertices_in_figure)
    plot.plot(points[:, 0], points[:, 1], color=_PATH, linewidth=2, solid_capstyle='round')
    plot.plot(*points[0], 'o', color=_INK, label='start')
    plot.plot(*points[-1], 's', color=_ACCENT, label='end')
    plot.set_aspect('equal', adjustable='datalim')
    plot.set_title('trajectory, normalised, start heading up', loc='left', fontsize=9)
    plot.grid(color=_MUTED, alpha=0.3)
    plot.margins(0.15)
    plot.legend(frameon=False, fontsize=8)


def _draw_codes(
    plot: Plot, seconds: Sequence[float], codes: Sequence[int], names: Sequence[str],
) -> None:
    values = np.asarray(codes)
    plot.step(seconds, values, where='post', color=_MUTED, linewidth=0.8)
    plot.scatter(seconds, values, s=7, color=_PATH, zorder=3)
    plot.set_yticks(range(len(names)), names)
    plot.set_ylim(-0.4, len(names) - 0.6)
    plot.grid(axis='y', color=_MUTED, alpha=0.3)


def _names(codes: type[Movement] | type[Direction]) -> list[str]:
    return [f'{code.name.lower().replace("_", " ")} {int(code)}' for code in codes]
