# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Ground truth, curves, figures and tables for the tests of quality."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
import sys
from typing import TypeVar

from benchmarks.shared.clips import Clip
from benchmarks.shared.report import ROOT
from matplotlib.figure import Figure
import numpy as np

IMAGES = ROOT / 'docs' / 'images'
#: Tolerance of a correct shift: in pixels, or as a share of the true shift.
_RIGHT_PX, _RIGHT_SHARE = 6.0, 0.15
#: A turn has at least the first shift, straight driving at most the second.
TURNING_PX, STRAIGHT_PX = 10.0, 3.0
_FLOOR = 1e-4

Item = TypeVar('Item')


def is_right(dx: float, truth: float) -> bool:
    """Return whether a shift is correct, within the effects of proximity and parallax."""
    return bool(abs(dx - truth) <= max(_RIGHT_PX, _RIGHT_SHARE * abs(truth)))


def is_turning(dx: float) -> bool:
    """Return whether the image moves enough for a turn."""
    return abs(dx) >= TURNING_PX


def true_shift(clip: Clip, first: int, second: int) -> float:
    """Return the shift of a pure rotation, in pixels; NaN beyond the frame."""
    yaw = clip.yaw[second] - clip.yaw[first]
    shift = clip.camera.focal * np.tan(np.clip(yaw, -1.5, 1.5))
    return float(shift) if abs(shift) < clip.camera.width / 2 else float('nan')


def rates(values: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Return the share of the values at or above each limit."""
    return 1.0 - np.searchsorted(np.sort(values), limits, side='left') / len(values)


def curve(good: np.ndarray, bad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """
    Return, for every limit, the shares of bad values accepted and of good ones lost.

    Values of minus infinity are never accepted.
    """
    limits = np.unique(np.concatenate([good, bad]))
    limits = limits[np.isfinite(limits)]
    return rates(bad, limits), 1.0 - rates(good, limits)


def draw(
    name: str, curves: Mapping[str, tuple[np.ndarray, np.ndarray]],
    chosen: tuple[float, float], labels: tuple[str, str],
) -> None:
    """Write a figure of curves, both axes logarithmic, with the chosen point."""
    figure = Figure(figsize=(6.4, 4.4), layout='constrained')
    plot = figure.add_subplot()
    for label, (false, lost) in curves.items():
        plot.plot(np.maximum(false, _FLOOR), np.maximum(lost, _FLOOR), label=label)
    plot.plot(*(max(each, _FLOOR) for each in chosen), 'ko', markersize=9, fillstyle='none',
              markeredgewidth=2, label='chosen')
    plot.set(xscale='log', yscale='log', xlabel=labels[0], ylabel=labels[1],
             xlim=(_FLOOR * 0.9, 1), ylim=(_FLOOR * 0.9, 1))
    plot.grid(alpha=0.3)
    plot.legend(fontsize='small')
    figure.savefig(IMAGES / f'quality_{name}.png', dpi=110)


def percent(share: float) -> str:
    """Return a share in per cent, with the digits that matter."""
    return f'{100 * share:.1f}' if share < 0.1 else f'{100 * share:.0f}'


def grouped(items: Iterable[Item], key: Callable[[Item], str]) -> dict[str, list[Item]]:
    """Return items by key, in the order in which the keys appear."""
    groups = defaultdict(list)
    for item in items:
        groups[key(item)].append(item)
    return dict(groups)


def say(what: str) -> None:
    """Report progress."""
    print(f'\r\033[K{what}', end='', file=sys.stderr, flush=True)
