# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of frames: thumbnails, what was left out of them, and the debug image."""

from dataclasses import dataclass
import math
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import LengthUnit, PAPER_THRESHOLD, TrajectoryEstimator, Update, View
from phase_traj_ros.core.frames.prepare import prepare
from phase_traj_ros.core.path.thinning import Thinned
from phase_traj_ros.io.images.decoding import GreyImage
from phase_traj_ros.io.replay.run import Watcher
from phase_traj_ros.io.results.palette import bgr, DARK, LIGHT
from phase_traj_ros.io.sources.base import StampedFrame

_SHIFT, _THRESHOLD, _BAND = bgr(DARK.line), bgr(DARK.accent), bgr(LIGHT.line)
_TEXT, _RIM = (255, 255, 255), (0, 0, 0)
_INSET_SHARE = 0.28
_FIXED, _SHADE = bgr(DARK.warn), 0.5
_JPEG_QUALITY = 72

Picture = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Thumbnail:
    """A small JPEG image of a frame."""

    frame: int
    """Number of the frame, 0 for the first. Frame n is the second one of pair n - 1."""
    jpeg: bytes


class Thumbnails(Watcher):
    """
    Watches a replay and keeps thumbnails of frames that are spread evenly over it.

    The number of thumbnails and their total size are bounded.
    """

    def __init__(self, *, width: int = 448, limit: int = 400, max_bytes: int = 5_500_000) -> None:
        """Keep up to ``limit`` images of ``width`` pixels at most, ``max_bytes`` in total."""
        self._width = width
        self._max_bytes = max_bytes
        self._thinned: Thinned[Thumbnail] = Thinned(limit)

    @property
    def kept(self) -> tuple[Thumbnail, ...]:
        """Return the thumbnails, in order."""
        return self._thinned.kept

    def start(self, frame: StampedFrame, estimator: TrajectoryEstimator) -> None:
        """Start with the first frame."""
        self._thinned.clear()
        self._take(frame, 0, estimator)

    def add(self, frame: StampedFrame, update: Update, estimator: TrajectoryEstimator) -> None:
        """Take the second frame of a pair."""
        self._take(frame, update.pair + 1, estimator)

    def _take(self, frame: StampedFrame, number: int, estimator: TrajectoryEstimator) -> None:
        if not self._thinned.wants_next:
            self._thinned.offer(None)
            return
        self._thinned.offer(Thumbnail(number, _jpeg(_small(frame, estimator, self._width))))
        while sum(len(each.jpeg) for each in self.kept) > self._max_bytes and len(self.kept) > 1:
            self._thinned.thin()


class LeftOutPicture(Watcher):
    """Keeps the newest frame of which a part is masked out as fixed to the camera."""

    def __init__(self, *, width: int = 640) -> None:
        """Make an image at most ``width`` pixels wide."""
        self._width = width
        self._kept: tuple[StampedFrame, NDArray[np.uint8], TrajectoryEstimator] | None = None

    def start(self, frame: StampedFrame, estimator: TrajectoryEstimator) -> None:
        """Start with the first frame."""
        self._kept = None

    def add(self, frame: StampedFrame, update: Update, estimator: TrajectoryEstimator) -> None:
        """Take the second frame of a pair."""
        left_out = estimator.left_out
        if left_out is not None:
            self._kept = frame, left_out, estimator

    @property
    def jpeg(self) -> bytes | None:
        """Return the frame with the fixed areas shaded; None if there never were any."""
        if self._kept is None:
            return None
        frame, left_out, estimator = self._kept
        grey = _small(frame, estimator, self._width)
        picture = cast('Picture', cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR))
        fixed = cv2.resize(left_out, grey.shape[::-1], interpolation=cv2.INTER_NEAREST)
        shade(picture, cast('Picture', fixed))
        return _jpeg(picture)


def as_shown(image: GreyImage, view: View) -> Picture:
    """
    Return a frame for display, (H, W) uint8, upright.

    Of 16 bits, the highest 8 in use are kept: many cameras use only 10 or 12. A float32 image is
    shown with the contrast in which it is measured.
    """
    if image.dtype == np.float32:
        image = prepare(image)
    elif image.dtype == np.uint16:
        bits = max(int(image.max(initial=0)).bit_length(), 8)
        image = np.right_shift(image, bits - 8).astype(np.uint8)
    return cast('Picture', np.ascontiguousarray(view.upright(image)))


def draw(frame: StampedFrame, update: Update, estimator: TrajectoryEstimator) -> Picture:
    """
    Return the debug image of the upright frame, BGR (H, W, 3).

    Fixed areas are shaded. An arrow from the middle is the shift,
    between lines at +T and -T, a quarter of the width away. Codes, response and distance are above
    it, the correlation map is in the lower right corner.
    """
    picture = cast('Picture', cv2.cvtColor(
        as_shown(frame.image, estimator.settings.view), cv2.COLOR_GRAY2BGR))
    if estimator.left_out is not None:
        shade(picture, estimator.left_out)
    _draw_shift(picture, update, estimator.settings.threshold_set)
    if update.shift is not None:
        _draw_map(picture, estimator)
    _draw_text(picture, update, estimator.settings.length_unit)
    return picture


def shade(picture: Picture, left_out: NDArray[np.uint8]) -> None:
    """Shade areas of a BGR image, (H, W, 3): those where ``left_out``, (H, W), is 0."""
    fixed = left_out == 0
    tinted = (1 - _SHADE) * picture[fixed] + _SHADE * np.array(_FIXED)
    picture[fixed] = tinted.astype(np.uint8)


def _jpeg(picture: Picture) -> bytes:
    return cv2.imencode('.jpg', picture, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])[1].tobytes()


def _small(frame: StampedFrame, estimator: TrajectoryEstimator, width: int) -> Picture:
    """Return an upright 8-bit copy of a frame, at most ``width`` pixels wide."""
    picture = as_shown(frame.image, estimator.settings.view)
    rows, columns = picture.shape
    if columns <= width:
        return picture.copy()
    size = (width, max(round(rows * width / columns), 1))
    return cast('Picture', cv2.resize(picture, size, interpolation=cv2.INTER_AREA))


def _draw_shift(picture: Picture, update: Update, threshold: float | None) -> None:
    height, width, _ = picture.shape
    # Scaled so that +T and -T are a quarter of the width away.
    scale = width / 4 / (threshold or PAPER_THRESHOLD)
    middle, row = width // 2, round(0.8 * height)
    for column in () if threshold is None else (middle - width // 4, middle + width // 4):
        cv2.line(picture, (column, row - 12), (column, row + 12), _THRESHOLD, 2)
    cv2.line(picture, (middle, row - 6), (middle, row + 6), _SHIFT, 1)
    if update.shift is not None:
        tip = round(middle + min(max(update.shift.dx * scale, -middle), middle))
        cv2.arrowedLine(picture, (middle, row), (tip, row), _SHIFT, 2, tipLength=0.2)


def _draw_map(picture: Picture, estimator: TrajectoryEstimator) -> None:
    height, width, _ = picture.shape
    size = (round(width * _INSET_SHARE), round(height * _INSET_SHARE))
    # The peak is one pixel, which would be lost in the reduction.
    correlation = cv2.dilate(estimator.correlation_map(), np.ones((3, 3), np.uint8))
    small = np.sqrt(np.maximum(
        cv2.resize(correlation, size, interpolation=cv2.INTER_NEAREST), 0.0))
    shades = (small * (255 / max(float(small.max()), 1e-6))).astype(np.uint8)
    picture[-size[1]:, -size[0]:] = cv2.applyColorMap(shades, cv2.COLORMAP_INFERNO)
    cv2.rectangle(picture, (width - size[0], height - size[1]), (width - 1, height - 1), _BAND, 1)


def _draw_text(picture: Picture, update: Update, unit: LengthUnit) -> None:
    shift = update.shift
    measured = 'no shift' if shift is None else (
        f'dx {shift.dx:+.1f} dy {shift.dy:+.1f} response {shift.response:.3f}')
    movement, direction = update.step.movement, update.step.direction
    lines = [
        f'movement {int(movement)} {movement.label}   direction {int(direction)}'
        f' {direction.label}   {update.status.value}',
        measured]
    travel, speed = update.travel, update.speed
    if travel is not None and speed is None:
        lines.append(f'distance {travel.state.value}')
    elif travel is not None:
        lines.append(
            f'distance {travel.distance:.2f} +- {math.sqrt(travel.variance):.2f} {unit.value}'
            f' {travel.state.value}   speed {speed:.2f} {unit.value}/s')
    scale = max(picture.shape[1] / 1600, 0.35)
    for index, line in enumerate(lines):
        column, row = 8, round((index + 1) * 34 * scale)
        # Moved, not thicker: since OpenCV 5, thicker letters are wider.
        for right, down, colour in (
                (-1, -1, _RIM), (-1, 1, _RIM), (1, -1, _RIM), (1, 1, _RIM), (0, 0, _TEXT)):
            cv2.putText(
                picture, line, (column + right, row + down), cv2.FONT_HERSHEY_SIMPLEX, scale,
                colour, 1, cv2.LINE_AA)
