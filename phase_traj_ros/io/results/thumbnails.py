# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Small copies of the frames of a replay, bounded in number and size."""

from collections.abc import Sequence
from dataclasses import dataclass, field
import math
from typing import cast

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Movement, PairStatus, TrajectoryEstimator, Update
from phase_traj_ros.core.heading.turns import Turn
from phase_traj_ros.core.path.thinning import Thinned
from phase_traj_ros.io.replay.run import Watcher
from phase_traj_ros.io.results.debug_picture import as_shown, Picture, shade
from phase_traj_ros.io.sources.base import StampedFrame

_JPEG_QUALITY = 72
_PER_TURN = 12
# A vehicle yaws above this rate in degrees per second; a longer pause than this is a straight.
_YAWING_DEG_S, _PAUSE_NS = 2.0, 500_000_000


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


@dataclass(slots=True)
class TurnFrames:
    """Frames of one turn."""

    pair: int
    """The pair on which it begins."""
    frames: Thinned[tuple[int, Picture]] = field(default_factory=lambda: Thinned(_PER_TURN))
    """Number of the frame (0 for the first of the replay) and image, (H, W) uint8."""

    last: int | None = None
    """The last frame that belongs to the turn; None for the last one kept."""

    def spread(self, count: int) -> tuple[tuple[int, Picture], ...]:
        """Return up to ``count`` of the frames, spread from the first to the last one kept."""
        kept = [
            each for each in self.frames.kept if self.last is None or each[0] <= self.last]
        places = np.linspace(0, len(kept) - 1, min(count, len(kept))).round().astype(int)
        return tuple(kept[place] for place in places)


class TurnWatcher(Watcher):
    """Watches a replay and keeps a few frames of each turn of the codes, up to ``limit`` turns."""

    def __init__(self, *, width: int = 480, limit: int = 12) -> None:
        """Keep images at most ``width`` pixels wide."""
        self._width = width
        self._limit = limit
        self._turns: list[TurnFrames] = []
        self._open: TurnFrames | None = None
        self._last: StampedFrame | None = None

    @property
    def turns(self) -> tuple[TurnFrames, ...]:
        """Return the turns kept, i.e. the first of the replay, in order."""
        return tuple(self._turns)

    def start(self, frame: StampedFrame, estimator: TrajectoryEstimator) -> None:
        """Start with the first frame."""
        self._turns = []
        self._open, self._last = None, frame

    def add(self, frame: StampedFrame, update: Update, estimator: TrajectoryEstimator) -> None:
        """Take the second frame of a pair."""
        last, self._last = self._last, frame
        if update.step.movement in (Movement.LEFT, Movement.RIGHT):
            self._open = None
            if len(self._turns) < self._limit:
                assert last is not None
                self._open = self._begin(last, update, estimator)
                self._turns.append(self._open)
        elif update.step.appended:
            self._open = None
        elif update.status is not PairStatus.TURNING:
            # A pair that could not be judged: the turn may continue after it.
            return
        if self._open is not None:
            self._keep(self._open, frame, update.pair + 1, estimator)

    def _begin(
        self, first: StampedFrame, update: Update, estimator: TrajectoryEstimator,
    ) -> TurnFrames:
        """Return the frames of a possible turn, which begins with the first frame of a pair."""
        begun = TurnFrames(update.pair)
        self._keep(begun, first, update.pair, estimator)
        return begun

    def _keep(
        self, turn: TurnFrames, frame: StampedFrame, number: int, estimator: TrajectoryEstimator,
    ) -> None:
        wanted = turn.frames.wants_next
        turn.frames.offer(
            (number, small(frame, estimator, self._width)) if wanted else None)


class HeadingTurnWatcher(TurnWatcher):
    """
    Keeps a few frames of each turn of the heading.

    Whether a yaw is a turn is known only when it has ended.
    """

    def __init__(self, *, width: int = 480, limit: int = 12) -> None:
        """Keep images at most ``width`` pixels wide."""
        super().__init__(width=width, limit=limit)
        self._stretches: dict[bool, TurnFrames] = {}
        self._yawed_ns: dict[bool, int] = {}

    def start(self, frame: StampedFrame, estimator: TrajectoryEstimator) -> None:
        """Start with the first frame."""
        super().start(frame, estimator)
        self._stretches.clear()

    def add(self, frame: StampedFrame, update: Update, estimator: TrajectoryEstimator) -> None:
        """Take the second frame of a pair."""
        last, self._last = self._last, frame
        for turn in update.turns:
            self._ended(turn)
        if update.heading is None or len(self._turns) >= self._limit:
            return
        rate = math.degrees(update.heading.yaw) / update.interval_ns * 1e9
        if abs(rate) > _YAWING_DEG_S:
            left = rate > 0
            if update.stamp_ns - self._yawed_ns.get(left, 0) > _PAUSE_NS + update.interval_ns:
                self._stretches.pop(left, None)
            self._yawed_ns[left] = update.stamp_ns
            if left not in self._stretches:
                assert last is not None
                self._stretches[left] = self._begin(last, update, estimator)
        for stretch in self._stretches.values():
            self._keep(stretch, frame, update.pair + 1, estimator)

    def finish(self, turns: Sequence[Turn]) -> None:
        """Keep the turns that end with the replay."""
        for turn in turns:
            self._ended(turn)

    def _ended(self, turn: Turn) -> None:
        stretch = self._stretches.pop(turn.angle_deg > 0, None)
        if stretch is not None and len(self._turns) < self._limit:
            self._turns.append(TurnFrames(turn.start_frame, stretch.frames, turn.end_frame))


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
