# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Small copies of the frames of a replay, kept within bounds however long it is."""

from dataclasses import dataclass, field
from typing import cast, Generic, TypeVar

import cv2
import numpy as np
from phase_traj_ros.core import Movement, PairStatus, TrajectoryEstimator, Update
from phase_traj_ros.io.debug_picture import as_shown, Picture
from phase_traj_ros.io.source import Frame

Item = TypeVar('Item')

_JPEG_QUALITY = 72
_PER_TURN = 12


class Thinned(Generic[Item]):
    """
    Every n-th of the items offered, in order, at most ``limit`` of them.

    n is 1 at first; whenever there are too many, every second one is dropped, and n doubles.
    """

    def __init__(self, limit: int) -> None:
        """Keep at most ``limit`` items, 2 or more."""
        self._limit = limit
        self.clear()

    def clear(self) -> None:
        """Begin anew."""
        self._kept: list[Item] = []
        self._every = 1
        self._offered = 0

    @property
    def wants_next(self) -> bool:
        """Return whether the next item would be kept: making it may cost something."""
        return self._offered % self._every == 0

    def offer(self, item: Item | None) -> None:
        """Take the next item; it may be None where it is not wanted."""
        if self.wants_next:
            assert item is not None
            self._kept.append(item)
        self._offered += 1
        if len(self._kept) > self._limit:
            self.thin()

    def thin(self) -> None:
        """Drop every second item."""
        self._kept = self._kept[::2]
        self._every *= 2

    @property
    def kept(self) -> tuple[Item, ...]:
        """Return what is kept, oldest first."""
        return tuple(self._kept)


@dataclass(frozen=True, slots=True)
class Thumbnail:
    """A small JPEG picture of a frame."""

    frame: int
    """Number of the frame, 0 for the first; frame n is the second one of pair n - 1."""
    jpeg: bytes


class Thumbnails:
    """
    Watches a replay and keeps thumbnails of frames that are evenly spread over it.

    Their number and their bytes in all are bounded.
    """

    def __init__(
        self, *, width: int = 448, limit: int = 400, max_bytes: int = 5_500_000,
    ) -> None:
        """Keep up to ``limit`` pictures, ``max_bytes`` in all, each at most ``width`` wide."""
        self._width = width
        self._max_bytes = max_bytes
        self._thinned: Thinned[Thumbnail] = Thinned(limit)

    @property
    def kept(self) -> tuple[Thumbnail, ...]:
        """Return the thumbnails, in order."""
        return self._thinned.kept

    def start(self, frame: Frame, estimator: TrajectoryEstimator) -> None:
        """Begin with the first frame."""
        self._thinned.clear()
        self._take(frame, 0, estimator)

    def add(self, frame: Frame, update: Update, estimator: TrajectoryEstimator) -> None:
        """Take the second frame of a pair."""
        self._take(frame, update.pair + 1, estimator)

    def _take(self, frame: Frame, number: int, estimator: TrajectoryEstimator) -> None:
        if not self._thinned.wants_next:
            self._thinned.offer(None)
            return
        picture = small(frame, estimator, self._width)
        _, jpeg = cv2.imencode('.jpg', picture, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
        self._thinned.offer(Thumbnail(number, jpeg.tobytes()))
        while (sum(len(each.jpeg) for each in self._thinned.kept) > self._max_bytes
               and len(self._thinned.kept) > 1):
            self._thinned.thin()


@dataclass(slots=True)
class TurnFrames:
    """Frames of one turn."""

    number: int
    """Of the turn, from 1 on."""
    frames: Thinned[tuple[int, Picture]] = field(default_factory=lambda: Thinned(_PER_TURN))
    """Number of the frame (0 for the first of the replay) and picture, (H, W) uint8."""

    def spread(self, count: int) -> tuple[tuple[int, Picture], ...]:
        """Return up to ``count`` frames, from the first to the last one kept."""
        kept = self.frames.kept
        places = np.linspace(0, len(kept) - 1, min(count, len(kept))).round().astype(int)
        return tuple(kept[place] for place in places)


class TurnWatcher:
    """Watches a replay and keeps a few frames of each turn, up to ``limit`` turns."""

    def __init__(self, *, width: int = 480, limit: int = 12) -> None:
        """Keep pictures at most ``width`` wide."""
        self._width = width
        self._limit = limit
        self._turns: list[TurnFrames] = []
        self._begun = 0
        self._open: TurnFrames | None = None
        self._last: Frame | None = None

    @property
    def turns(self) -> tuple[TurnFrames, ...]:
        """Return the turns kept, the first of the replay, in order."""
        return tuple(self._turns)

    def start(self, frame: Frame, estimator: TrajectoryEstimator) -> None:
        """Begin with the first frame."""
        self._turns, self._begun = [], 0
        self._open, self._last = None, frame

    def add(self, frame: Frame, update: Update, estimator: TrajectoryEstimator) -> None:
        """Take the second frame of a pair."""
        last, self._last = self._last, frame
        if update.step.movement in (Movement.LEFT, Movement.RIGHT):
            self._begun += 1
            self._open = None
            if len(self._turns) < self._limit:
                self._open = TurnFrames(self._begun)
                self._turns.append(self._open)
                assert last is not None
                self._keep(self._open, last, update.pair, estimator)
        elif update.step.appended:
            self._open = None
        elif update.status is not PairStatus.TURNING:
            # A pair that could not be judged: the turn may go on after it.
            return
        if self._open is not None:
            self._keep(self._open, frame, update.pair + 1, estimator)

    def _keep(
        self, turn: TurnFrames, frame: Frame, number: int, estimator: TrajectoryEstimator,
    ) -> None:
        wanted = turn.frames.wants_next
        turn.frames.offer(
            (number, small(frame, estimator, self._width)) if wanted else None)


def small(frame: Frame, estimator: TrajectoryEstimator, width: int) -> Picture:
    """Return an upright 8-bit copy of a frame, at most ``width`` pixels wide."""
    picture = as_shown(frame.image, rotate_180=estimator.settings.view.rotate_180)
    rows, columns = picture.shape
    if columns <= width:
        return picture.copy()
    size = (width, max(round(rows * width / columns), 1))
    return cast('Picture', cv2.resize(picture, size, interpolation=cv2.INTER_AREA))
