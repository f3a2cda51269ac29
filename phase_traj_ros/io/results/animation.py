# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Animated GIF of a replay: the camera image, the path as it grows, and the shift."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Axes, to_axes, TrajectoryEstimator, Update
from phase_traj_ros.core.path.thinning import Thinned
from phase_traj_ros.errors import MissingDependencyError
from phase_traj_ros.io.replay.overview import Overview, overview
from phase_traj_ros.io.replay.run import Replay, Watcher
from phase_traj_ros.io.results.debug_picture import Picture
from phase_traj_ros.io.results.palette import LIGHT, rgb
from phase_traj_ros.io.results.thumbnails import small
from phase_traj_ros.io.sources.base import StampedFrame

_WIDTH = 440
_FRAMES = 120
_MAX_BYTES = 1_400_000
_PANEL = 150
_GREYS = 16
_BLENDS = 5
# Red, green, blue.
_PAPER, _INK = rgb(LIGHT.card), rgb(LIGHT.ink)
_LINE, _FAINT_LINE, _ACCENT = rgb(LIGHT.line), rgb(LIGHT.tint), rgb(LIGHT.accent)
_FONT = cv2.FONT_HERSHEY_SIMPLEX
# Shortest and longest time that an image is shown, and that of the last one, in milliseconds.
_SHORTEST_MS, _LONGEST_MS, _LAST_MS = 40, 200, 1500


@dataclass(frozen=True, slots=True)
class _Scene:
    """An image of the animation, made from the second frame of a pair."""

    update: Update
    picture: Picture


class Animation(Watcher):
    """Watches a replay and draws it as an animated GIF of bounded length and size."""

    def __init__(self, *, width: int = _WIDTH, limit: int = _FRAMES) -> None:
        """
        Keep up to ``limit`` frames, each at most ``width`` pixels wide.

        Raises
        ------
        MissingDependencyError
            Pillow is not installed.

        """
        try:
            import PIL.Image  # noqa: F401
        except ImportError:
            raise MissingDependencyError(
                'animations need Pillow: install python3-pil (apt) or Pillow (pip), or leave out'
                ' animation') from None
        self._width = width
        self._scenes: Thinned[_Scene] = Thinned(limit)

    def start(self, frame: StampedFrame, estimator: TrajectoryEstimator) -> None:
        """Start with the first frame."""
        self._scenes.clear()

    def add(self, frame: StampedFrame, update: Update, estimator: TrajectoryEstimator) -> None:
        """Take the second frame of a pair."""
        wanted = self._scenes.wants_next
        self._scenes.offer(
            _Scene(update, small(frame, estimator, self._width)) if wanted else None)

    def write(self, result: Replay, path: Path, *, max_bytes: int = _MAX_BYTES) -> None:
        """Write the GIF. If it would exceed ``max_bytes``, use fewer images."""
        canvas = _Canvas(result)
        scenes = self._scenes.kept
        # Frames of another size come after a change of camera: they do not fit.
        shape = scenes[0].picture.shape
        pictures = [canvas.draw(each) for each in scenes if each.picture.shape == shape]
        seconds = float(overview(result).seconds[-1])
        while len(content := _gif(pictures, seconds)) > max_bytes and len(pictures) > 2:
            pictures = pictures[::2]
        path.write_bytes(content)


class _Canvas:
    """Draws a camera image above the path and the shift of the whole replay."""

    def __init__(self, result: Replay) -> None:
        self._shown: Overview = overview(result)
        self._threshold = result.threshold_px
        self._points = to_axes(self._shown.path.astype(np.float64), Axes.FIGURE)

    def draw(self, scene: _Scene) -> Picture:
        """Return an image, (H, W, 3) in the order red, green, blue."""
        # The texture of asphalt would fill most of a GIF.
        above = cv2.cvtColor(cv2.medianBlur(scene.picture, 3), cv2.COLOR_GRAY2RGB)
        width = above.shape[1]
        below = np.full((_PANEL, width, 3), _PAPER, np.uint8)
        side = min(_PANEL, width // 2)
        self._draw_path(below[:, :side], scene.update.pair + 1)
        self._draw_shift(below[:, side:], scene.update.pair)
        self._write_codes(below[:, side:], scene.update)
        return cast('Picture', np.concatenate([above, below]))

    def _draw_path(self, panel: Picture, vertices: int) -> None:
        points = _fitted(self._points, panel.shape, margin=16)
        _polyline(panel, points, _FAINT_LINE, 2)
        _polyline(panel, points[:vertices + 1], _LINE, 2)
        cv2.circle(panel, points[0].tolist(), 4, _INK, -1, cv2.LINE_AA)
        cv2.circle(panel, points[vertices].tolist(), 5, _ACCENT, -1, cv2.LINE_AA)

    def _draw_shift(self, panel: Picture, pair: int) -> None:
        height, width, _ = panel.shape
        dx = np.nan_to_num(self._shown.dx)
        top, bottom = 66, height - 10
        high = max(float(np.abs(dx).max()), 1.5 * (self._threshold or 1.0))
        y = (top + bottom) / 2 - dx / high * (bottom - top) / 2
        x = np.linspace(8, width - 12, len(dx))
        points = np.stack([x, y], axis=1).round().astype(np.int32)
        levels = () if self._threshold is None else (self._threshold, -self._threshold)
        for level in levels:
            row = round((top + bottom) / 2 - level / high * (bottom - top) / 2)
            for left in range(8, width - 12, 8):
                cv2.line(panel, (left, row), (left + 3, row), _ACCENT, 1)
        _polyline(panel, points, _FAINT_LINE, 1)
        _polyline(panel, points[:pair + 1], _LINE, 2)
        cv2.circle(panel, points[pair].tolist(), 4, _ACCENT, -1, cv2.LINE_AA)

    def _write_codes(self, panel: Picture, update: Update) -> None:
        movement, direction = update.step.movement, update.step.direction
        shift = 'not measured' if update.shift is None else f'{update.shift.dx:+.0f} px'
        for row, (name, text) in enumerate((
                ('movement', f'{int(movement)} {movement.label}'),
                ('direction', f'{int(direction)} {direction.label}'),
                ('shift', shift))):
            for column, word in ((8, name), (90, text)):
                place = (column, 18 + 17 * row)
                cv2.putText(panel, word, place, _FONT, 0.42, _INK, 1, cv2.LINE_AA)


def _fitted(
    points: NDArray[np.float64], shape: tuple[int, ...], *, margin: int,
) -> NDArray[np.int32]:
    """Return points (x right, y up) as columns and rows of a panel, centred in it."""
    room = np.array([shape[1], shape[0]], np.float64) - 2 * margin
    extent = np.ptp(points, axis=0)
    scale = float((room / np.maximum(extent, 1e-9)).min())
    moved = (points - points.min(axis=0)) * scale + (room - extent * scale) / 2 + margin
    moved[:, 1] = shape[0] - moved[:, 1]
    return cast('NDArray[np.int32]', moved.round().astype(np.int32))


def _polyline(
    panel: Picture, points: NDArray[np.int32], colour: Sequence[int], thickness: int,
) -> None:
    cv2.polylines(panel, [points.reshape(-1, 1, 2)], False, colour, thickness, cv2.LINE_AA)


def _palette() -> list[int]:
    """Return a few greys for the camera image, and the colours of the drawing with soft edges."""
    greys = [[round(level)] * 3 for level in np.linspace(0, 255, _GREYS)]
    blends = [
        np.round(np.array(colour) * share + np.array(_PAPER) * (1 - share)).astype(int).tolist()
        for colour in (_LINE, _FAINT_LINE, _ACCENT)
        for share in np.linspace(1.0, 0.2, _BLENDS)]
    return [value for colour in (*greys, *blends) for value in colour]


def _gif(pictures: Sequence[Picture], seconds: float) -> bytes:
    from PIL import Image
    each_ms = round(1e3 * seconds / len(pictures) / 2)
    durations = [min(max(each_ms, _SHORTEST_MS), _LONGEST_MS)] * len(pictures)
    durations[-1] = _LAST_MS
    palette = Image.new('P', (1, 1))
    palette.putpalette(_palette())
    images = [
        Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE)
        for picture in pictures]
    content = BytesIO()
    images[0].save(
        content, 'GIF', save_all=True, append_images=images[1:], duration=durations, loop=0,
        optimize=False)
    return content.getvalue()
