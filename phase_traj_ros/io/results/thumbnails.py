# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Small copies of the frames of a replay, bounded in number and size."""

from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import TrajectoryEstimator, Update
from phase_traj_ros.core.path.thinning import Thinned
from phase_traj_ros.io.replay.run import Watcher
from phase_traj_ros.io.results.debug_picture import as_shown, Picture, shade
from phase_traj_ros.io.sources.base import StampedFrame

_JPEG_QUALITY = 72


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

    def __init__(
        self, *, width: int = 448, limit: int = 400, max_bytes: int = 5_500_000,
    ) -> None:
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
        picture = small(frame, estimator, self._width)
        self._thinned.offer(Thumbnail(number, _jpeg(picture)))
        while (sum(len(each.jpeg) for each in self._thinned.kept) > self._max_bytes
               and len(self._thinned.kept) > 1):
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
        grey = small(frame, estimator, self._width)
        picture = cast('Picture', cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR))
        fixed = cv2.resize(left_out, grey.shape[::-1], interpolation=cv2.INTER_NEAREST)
        shade(picture, cast('Picture', fixed), rotate_180=estimator.settings.view.rotate_180)
        return _jpeg(picture)


def _jpeg(picture: Picture) -> bytes:
    return cv2.imencode('.jpg', picture, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])[1].tobytes()


def small(frame: StampedFrame, estimator: TrajectoryEstimator, width: int) -> Picture:
    """Return an upright 8-bit copy of a frame, at most ``width`` pixels wide."""
    picture = as_shown(frame.image, rotate_180=estimator.settings.view.rotate_180)
    rows, columns = picture.shape
    if columns <= width:
        return picture.copy()
    size = (width, max(round(rows * width / columns), 1))
    return cast('Picture', cv2.resize(picture, size, interpolation=cv2.INTER_AREA))
