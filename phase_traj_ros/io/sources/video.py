# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames from a video file, read by OpenCV."""

from bisect import bisect_left
import codecs
from collections.abc import Generator
from functools import partial
import math
from pathlib import Path
import re
from typing import cast, Final

import cv2
from phase_traj_ros.errors import SourceError
from phase_traj_ros.io.images.decoding import GreyImage
from phase_traj_ros.io.images.picture_file import PICTURE_SUFFIXES
from phase_traj_ros.io.sources.base import Candidate, DEFAULT_FPS, FrameSource, index_stamp_ns
from phase_traj_ros.io.sources.selection import EVERYTHING, Selection

_MAX_CONTAINER_FPS = 1000.0
_MAX_FRAME_COUNT = 2 ** 32
_MAX_POSITION_MS = 1e12
_SNIFFED_BYTES = 4096

RAW_STREAM: Final = re.compile(rb'\xff\xd8\xff|\x00?\x00\x00\x01[^\xba]')
"""Start of a stream without a container: JPEG, H.264, H.265 or MPEG, not a program stream's."""


class VideoClock:
    """
    Stamps of the frames of a video, from the positions that its reader reports.

    A position is used if it is later than that of the previous frame. Otherwise (some containers
    and readers give none) the stamp advances by one period of the frame rate. So stamps always
    increase.
    """

    def __init__(self, fps: float, *, use_positions: bool = True) -> None:
        self._fps = fps
        self._use_positions = use_positions
        self._anchor_ns = 0
        self._since_anchor = -1
        self._last_ns = 0

    def stamp_ns(self, position_ms: float) -> int:
        """Return the stamp in nanoseconds of the next frame, given its position."""
        self._since_anchor += 1
        stamp_ns = self._anchor_ns + index_stamp_ns(self._since_anchor, self._fps)
        if self._use_positions and 0 < position_ms < _MAX_POSITION_MS:
            position_ns = round(position_ms * 1e6)
            if position_ns > self._last_ns:
                stamp_ns = self._anchor_ns = position_ns
                self._since_anchor = 0
        self._last_ns = stamp_ns
        return stamp_ns


class VideoSource(FrameSource):
    """
    The frames of a video, as luma.

    The stamps are the positions in the file, or those of a constant rate if fps is given. Frames
    that are not selected are skipped without being converted.

    Raises SourceError if the file is not a video or if none of its frames can be decoded.
    """

    def __init__(
        self,
        path: Path,
        *,
        selection: Selection = EVERYTHING,
        fps: float | None = None,
    ) -> None:
        start = start_of(path)
        self._path = path
        capture = self._open()
        try:
            if not capture.grab():
                raise SourceError(f'{path}: no frame of the video can be decoded')
            self._retrieve(capture, 0)
            own_fps = capture.get(cv2.CAP_PROP_FPS)
            count = capture.get(cv2.CAP_PROP_FRAME_COUNT)
        finally:
            capture.release()
        usable = math.isfinite(own_fps) and 0 < own_fps <= _MAX_CONTAINER_FPS
        # For a stream without a container, the reader may have invented the rate.
        assumed = fps is None and (not usable or RAW_STREAM.match(start) is not None)
        self._use_positions = fps is None
        self._fps = fps if fps is not None else own_fps if usable else DEFAULT_FPS
        super().__init__(
            description=f'{path} (video, {self._fps:g} frames per second'
                        f'{" assumed" if assumed else ""})',
            selection=selection,
            frame_count=self._expected(count, selection),
            declared=int(count) if _is_count(count) else None)

    def _expected(self, count: float, selection: Selection) -> int | None:
        """Return how many of the frames that the file claims to hold are selected."""
        if not _is_count(count):
            return None
        indices = range(int(count))
        stamp = partial(index_stamp_ns, fps=self._fps)
        first = bisect_left(indices, selection.start_ns, key=stamp)
        last = len(indices)
        if selection.end_ns is not None:
            last = bisect_left(indices, selection.end_ns, key=stamp)
        return len(range(first, last, selection.every)) or None

    def _candidates(self) -> Generator[Candidate, None, None]:
        clock = VideoClock(self._fps, use_positions=self._use_positions)
        capture = self._open()
        try:
            index = 0
            while capture.grab():
                stamp_ns = clock.stamp_ns(capture.get(cv2.CAP_PROP_POS_MSEC))
                yield Candidate(stamp_ns, partial(self._retrieve, capture, index))
                index += 1
        finally:
            capture.release()

    def _open(self) -> cv2.VideoCapture:
        # Listed explicitly: cv2.CAP_ANY includes a reader of numbered pictures, which takes any
        # name with digits for a pattern.
        wanted = [
            backend for backend in (cv2.CAP_FFMPEG, cv2.CAP_GSTREAMER)
            if cv2.videoio_registry.hasBackend(backend)
        ]
        for backend in wanted or [cv2.CAP_ANY]:
            capture = cv2.VideoCapture(str(self._path), backend)
            if capture.isOpened():
                return capture
            capture.release()
        raise SourceError(
            f'{self._path} cannot be opened as a video; give a bag, a video or a folder of '
            'pictures')

    def _retrieve(self, capture: cv2.VideoCapture, index: int) -> GreyImage:
        """Return the frame that was grabbed last, as luma."""
        done, image = capture.retrieve()
        if not done or cast('object', image) is None:
            raise SourceError(f'{self._path}: frame {index} of the video cannot be decoded')
        if image.ndim == 3:
            image = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        return cast('GreyImage', image)


def _is_count(count: float) -> bool:
    return math.isfinite(count) and 0 < count <= _MAX_FRAME_COUNT


def start_of(path: Path) -> bytes:
    """
    Return the first bytes of a video.

    Raises SourceError for files that a video reader would accept but that are not videos.
    """
    if path.suffix.lower() in PICTURE_SUFFIXES:
        raise SourceError(f'{path} is a single picture; give the folder that holds it')
    try:
        with path.open('rb') as file:
            start = file.read(_SNIFFED_BYTES)
    except OSError as error:
        raise SourceError(f'{path} cannot be read: {error.strerror}') from error
    # FFmpeg plays text files as terminal output.
    if _is_text(start):
        raise SourceError(
            f'{path} is a text file, not a video; give a bag, a video or a folder of pictures')
    return start


def _is_text(start: bytes) -> bool:
    """Return whether the first bytes of a file are text; all video formats have zeros early."""
    if 0 in start:
        return False
    try:
        # The last character may be incomplete.
        codecs.getincrementaldecoder('utf-8')().decode(start, final=False)
    except UnicodeDecodeError:
        return False
    return True
