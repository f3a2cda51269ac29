# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Draw the pictures of docs/explanation/method.md from a rendered drive.

They redraw the paper's figures 1 and 2 (two frames and their correlation map), 3 (the directions),
4 (the codes of a drive) and 8 (its trajectory). The same drive always gives the same files.
"""

from pathlib import Path

import cv2
from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np
from phase_traj_ros.core import (
    DynamicChainCode,
    Movement,
    PhaseCorrelator,
    Shift,
    vertices,
)
from phase_traj_ros.io.results.palette import LIGHT
from phase_traj_ros.synthetic import Drive, named_drive, render_drive

IMAGES = Path(__file__).resolve().parent.parent / 'docs' / 'images'
THRESHOLD = 16.0
#: A pair in the middle of the first turn, to the left.
PAIR = 45
#: Half the sides of the part of the correlation map that is shown, in pixels.
AROUND = (40, 120)
COLOURS = {
    Movement.LEFT: LIGHT.left, Movement.FORWARD: LIGHT.forward, Movement.RIGHT: LIGHT.right,
    Movement.NO_CHANGE: LIGHT.rest}


def main() -> None:
    """Render the drive once, and write all pictures."""
    drive = named_drive('demo')
    frames = list(render_drive(drive))
    correlator, codes = PhaseCorrelator(), DynamicChainCode(THRESHOLD)
    shifts: list[Shift] = []
    for number, frame in enumerate(frames):
        shift = correlator.update(frame)
        if shift is None:
            continue
        shifts.append(shift)
        codes.update(shift.dx)
        if number == PAIR:
            write('frames_map_shift', draw_pair(
                frames[number - 1], frame, correlator.correlation_map(), shift))
    write('shift_and_codes', draw_codes([shift.dx for shift in shifts], codes))
    write('trajectory', draw_trajectory(drive, codes))


def draw_pair(
    first: np.ndarray, second: np.ndarray, correlation: np.ndarray, shift: Shift,
) -> Figure:
    """Return two frames, and the correlation map around the zero shift with its peak."""
    figure = Figure(figsize=(6.4, 5.6), layout='constrained')
    plots = figure.subplots(3, 1, height_ratios=(1, 1, 1.1))
    for plot, frame, title in (
            (plots[0], first, 'previous frame'), (plots[1], second, 'current frame')):
        small = cv2.resize(frame, None, fx=0.4, fy=0.4, interpolation=cv2.INTER_AREA)
        plot.imshow(small, cmap='gray', interpolation='nearest', vmin=0, vmax=255)
        plot.set_title(title, fontsize='small', loc='left')
        plot.set_axis_off()
    rows, columns = (side // 2 for side in correlation.shape)
    part = correlation[rows - AROUND[0]:rows + AROUND[0] + 1,
                       columns - AROUND[1]:columns + AROUND[1] + 1]
    plot = plots[2]
    plot.imshow(
        part, cmap='gray_r', interpolation='nearest', vmin=0, vmax=0.4 * part.max(),
        extent=(-AROUND[1] - 0.5, AROUND[1] + 0.5, AROUND[0] + 0.5, -AROUND[0] - 0.5))
    plot.axhline(0, color=LIGHT.rule, linewidth=0.8)
    plot.axvline(0, color=LIGHT.rule, linewidth=0.8)
    plot.plot(shift.dx, shift.dy, 'o', color=LIGHT.accent, markersize=12, fillstyle='none')
    plot.annotate(
        f'peak: Δx = {shift.dx:+.1f} px, response {shift.response:.2f}', (shift.dx, shift.dy),
        (-12, 14), textcoords='offset points', color=LIGHT.accent, fontsize='small', ha='right')
    plot.set_title('correlation map around the zero shift', fontsize='small', loc='left')
    plot.set(xlabel='Δx, px', ylabel='Δy, px')
    return figure


def draw_codes(shifts: list[float], codes: DynamicChainCode) -> Figure:
    """Return the shift between the lines of ±T, and the movement code of each pair below."""
    figure = Figure(figsize=(7.2, 3.4), layout='constrained')
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(5, 1))
    pairs = np.arange(1, len(shifts) + 1)
    upper.plot(pairs, shifts, color=LIGHT.line, linewidth=1.2)
    for sign, side in ((1, 'left'), (-1, 'right')):
        upper.axhline(sign * THRESHOLD, color=LIGHT.accent, linewidth=0.8, linestyle='--')
        upper.annotate(
            f'{"+" if sign > 0 else "−"}T: {side}', (len(shifts), sign * THRESHOLD),
            (-2, 3 * sign), textcoords='offset points', color=LIGHT.accent, fontsize='small',
            ha='right', va='bottom' if sign > 0 else 'top')
    upper.set_ylabel('Δx, px')
    upper.grid(color=LIGHT.rule, linewidth=0.5)
    movement = list(codes.movement)
    lower.bar(pairs, 1.0, width=1.0, color=[COLOURS[Movement(code)] for code in movement])
    start = 0
    for run in codes.movement.runs:
        code, count = run.code, run.count
        lower.annotate(
            str(int(code)), (start + (count + 1) / 2, 1.15 if count < 3 else 0.5), ha='center',
            va='bottom' if count < 3 else 'center', fontsize='small', annotation_clip=False)
        start += count
    lower.set(yticks=(), xlabel='pair', ylabel='movement', xlim=(0.5, len(shifts) + 0.5))
    return figure


def draw_trajectory(drive: Drive, codes: DynamicChainCode) -> Figure:
    """Return the directions with their codes, the drawn trajectory, and the true one."""
    figure = Figure(figsize=(7.2, 3.0), layout='constrained')
    plots = figure.subplots(1, 3)
    draw_directions(plots[0])
    drawn = vertices(codes.direction)
    for plot, points, title in (
            (plots[1], drawn, 'drawn'), (plots[2], drive.poses[:, :2], 'true')):
        # Up is forward, and left is left: x of REP 103 goes up, y to the left.
        x, y = -points[:, 1], points[:, 0]
        longer = max(np.ptp(x), np.ptp(y))
        x, y = (x - x[0]) / longer, (y - y[0]) / longer
        plot.plot(x, y, color=LIGHT.line, linewidth=2)
        plot.plot(x[0], y[0], 'o', color=LIGHT.ink, markersize=6)
        plot.plot(x[-1], y[-1], 's', color=LIGHT.accent, markersize=6)
        plot.set_title(title, fontsize='small')
        plot.set_aspect('equal')
        plot.set(xticks=(), yticks=())
        plot.margins(0.1)
    return figure


def draw_directions(plot: Axes) -> None:
    """Draw the four directions with their codes."""
    for code, x, y, word in (
            (0, -1, 0, 'left'), (1, 0, 1, 'forward'), (2, 1, 0, 'right'), (3, 0, -1, 'backward')):
        plot.annotate('', (x, y), (0, 0), arrowprops={'arrowstyle': '->', 'color': LIGHT.ink})
        plot.text(
            1.35 * x, 1.25 * y, f'{code}\n{word}', ha='center', va='center', fontsize='small')
    plot.set(xlim=(-1.8, 1.8), ylim=(-1.6, 1.6))
    plot.set_title('direction codes', fontsize='small')
    plot.set_aspect('equal')
    plot.set_axis_off()


def write(name: str, figure: Figure) -> None:
    """Write a picture, without a date or a version in it."""
    path = IMAGES / f'{name}.png'
    figure.savefig(path, dpi=90, metadata={'Software': None})
    print(f'written to {path}, {path.stat().st_size // 1024} kB')


if __name__ == '__main__':
    main()
