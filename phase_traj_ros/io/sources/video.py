# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames from a video file: what both readers share, and the one by OpenCV."""

from abc import abstractmethod
from bisect import bisect_left
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
import re
from typing import cast

import cv2
import numpy as np
from phase_traj_ros.errors import reading, SourceError
from phase_traj_ros.io.images.decoding import GreyImage, PICTURE_SUFFIXES
from phase_traj_ros.io.sources.base import Candidate, DEFAULT_FPS, FrameSource, index_stamp_ns
from phase_traj_ros.io.sources.selection import EVERYTHING, Selection

_MAX_CONTAINER_FPS = 1000.0
_MAX_PIXEL_ASPECT = 4.0
_MAX_FRAME_COUNT = 2 ** 32
_MAX_POSITION_MS = 1e12
_SNIFFED_BYTES = 4096
# Types of the boxes with which an MP4 or QuickTime file begins.
_MP4_BOXES = (b'ftyp', b'moov', b'mdat', b'free', b'skip', b'wide')

RAW_STREAM = re.compile(rb'\xff\xd8\xff|\x00?\x00\x00\x01[^\xba]')
"""Start of a stream without a container: JPEG, H.264, H.265 or MPEG, not a program stream's."""


class VideoClock:
    """
    Stamps of the frames of a video, from the positions that its reader reports.

    A position is used if it is later than that of the previous frame. Otherwise (some containers
    and readers give none) the stamp advances by one period of the frame rate. So stamps always
    increase.
    """

    def __init__(self, fps: float) -> None:
        self._fps = fps
        self._anchor_ns = 0
        self._since_anchor = -1
        self._last_ns = 0

    def stamp_ns(self, position_ns: int | None) -> int:
        """Return the stamp in nanoseconds of the next frame, given its position if known."""
        self._since_anchor += 1
        stamp_ns = self._anchor_ns + index_stamp_ns(self._since_anchor, self._fps)
        if position_ns is not None and position_ns > self._last_ns:
            stamp_ns = self._anchor_ns = position_ns
            self._since_anchor = 0
        self._last_ns = stamp_ns
        return stamp_ns


@dataclass(frozen=True, slots=True)
class VideoFacts:
    """What a reader knows of a video before it reads it through; 0 where it is not known."""

    fps: float
    frames: int
    seconds: float = 0.0
    pixel_aspect: float = 1.0
    """Width of a pixel divided by its height."""


class VideoFile(FrameSource):
    """
    The frames of a video, as luma.

    Raises SourceError if the file is not a video or if none of its frames can be decoded.
    """

    def __init__(
        self, path: Path, *, selection: Selection = EVERYTHING, fps: float | None = None,
    ) -> None:
        self._path = path
        self._start = start_of(path)
        facts = self._examine()
        usable = 0 < facts.fps <= _MAX_CONTAINER_FPS
        # For a stream without a container, the reader may have invented the rate.
        assumed = fps is None and (not usable or RAW_STREAM.match(self._start) is not None)
        self._is_constant = fps is not None
        credible = 1 / _MAX_PIXEL_ASPECT < facts.pixel_aspect < _MAX_PIXEL_ASPECT
        self._pixel_aspect = facts.pixel_aspect if credible else 1.0
        self._fps = fps if fps is not None else facts.fps if usable else DEFAULT_FPS
        super().__init__(
            description=f'{path} (video, {self._fps:g} frames per second'
                        f'{" assumed" if assumed else ""})',
            selection=selection, declared=facts.frames or None,
            # For progress bars, the duration is enough; a fragmented .mp4 has no other number.
            frame_count=self._expected(
                max(facts.frames, round(facts.seconds * self._fps)), selection))

    @abstractmethod
    def _examine(self) -> VideoFacts:
        """Open the video and decode its first frame; return what is known of it."""

    def _expected(self, count: int, selection: Selection) -> int | None:
        """Return how many of ``count`` frames are selected, at the usual rate."""
        stamp = partial(index_stamp_ns, fps=self._fps)
        first = bisect_left(range(count), selection.start_ns, key=stamp)
        last = count if selection.end_ns is None else bisect_left(
            range(count), selection.end_ns, key=stamp)
        return len(range(first, last, selection.every)) or None

    def _with_square_pixels(self, image: GreyImage) -> GreyImage:
        """Return an image, (H, W), as it is shown: pixels that are not square become square."""
        height, width = image.shape
        shown = round(width * self._pixel_aspect)
        if shown == width:
            return image
        return cast('GreyImage', cv2.resize(image, (shown, height), interpolation=cv2.INTER_AREA))

    def _not_opened(self, reason: str) -> SourceError:
        if self._start[4:8] in _MP4_BOXES:
            return SourceError(
                f'{self._path} is cut off or damaged ({reason}): the index of an .mp4 or .mov is'
                ' written at the end of the recording; repair it (such as with untrunc), or record'
                ' to .mkv')
        return SourceError(
            f'{self._path} cannot be opened as a video ({reason}); give a bag, a video or a folder'
            ' of images')

    def _undecodable(self, number: int, reason: str = '') -> SourceError:
        return SourceError(f'{self._path}: frame {number} of the video cannot be decoded{reason}')


class VideoSource(VideoFile):
    """
    The frames of a video, read by OpenCV.

    The stamps are the positions in the file, or those of a constant rate if fps is given. Frames
    that are not selected are skipped without being converted.
    """

    def _examine(self) -> VideoFacts:
        with self._capture() as capture:
            if not capture.read()[0]:
                raise SourceError(f'{self._path}: no frame of the video can be decoded')
            count = capture.get(cv2.CAP_PROP_FRAME_COUNT)
            aspect = capture.get(cv2.CAP_PROP_SAR_NUM), capture.get(cv2.CAP_PROP_SAR_DEN)
            # OpenCV rotates the images itself, but tells the pixels of the stored ones.
            self._swaps_axes = bool(capture.get(cv2.CAP_PROP_ORIENTATION_AUTO)) and (
                round(capture.get(cv2.CAP_PROP_ORIENTATION_META)) % 180 == 90)
            return VideoFacts(
                capture.get(cv2.CAP_PROP_FPS),
                int(count) if 0 < count <= _MAX_FRAME_COUNT else 0,
                pixel_aspect=aspect[0] / aspect[1] if min(aspect) > 0 else 1.0)

    def _candidates(self) -> Generator[Candidate, None, None]:
        clock, index = VideoClock(self._fps), 0
        with self._capture() as capture:
            while capture.grab():
                position_ms = 0.0 if self._is_constant else capture.get(cv2.CAP_PROP_POS_MSEC)
                # Some readers give absurd ones, or NaN.
                credible = 0 < position_ms < _MAX_POSITION_MS
                stamp_ns = clock.stamp_ns(round(position_ms * 1e6) if credible else None)
                yield Candidate(index, stamp_ns, partial(self._retrieve, capture, index))
                index += 1

    @contextmanager
    def _capture(self) -> Iterator[cv2.VideoCapture]:
        """Open the file."""
        # Listed explicitly: cv2.CAP_ANY includes a reader of numbered pictures, which takes any
        # name with digits for a pattern.
        for backend in (cv2.CAP_FFMPEG, cv2.CAP_GSTREAMER):
            capture = cv2.VideoCapture(str(self._path), backend)
            try:
                if capture.isOpened():
                    yield capture
                    return
            finally:
                capture.release()
        raise self._not_opened('OpenCV has no reader for it')

    def _retrieve(self, capture: cv2.VideoCapture, index: int) -> GreyImage:
        """Return the frame that was grabbed last, as luma."""
        done, image = capture.retrieve()
        if not done or cast('object', image) is None:
            raise self._undecodable(index)
        if image.ndim == 3:
            image = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        image = cast('GreyImage', image)
        if self._swaps_axes:
            upright = self._with_square_pixels(image.T).T
            return cast('GreyImage', np.ascontiguousarray(upright))
        return self._with_square_pixels(image)


def start_of(path: Path) -> bytes:
    """
    Return the first bytes of a video.

    Raises SourceError for files that a video reader would accept but that are not videos.
    """
    if path.suffix.lower() in PICTURE_SUFFIXES:
        raise SourceError(f'{path} is a single image; give the folder that holds it')
    with reading(path), path.open('rb') as file:
        start = file.read(_SNIFFED_BYTES)
    # FFmpeg plays text files as terminal output. All video formats have zeros early.
    if 0 not in start:
        raise SourceError(
            f'{path} is a text file, not a video; give a bag, a video or a folder of images')
    return start
