# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Frames from a video file, read by PyAV.

Unlike OpenCV's reader, it gives exact presentation times, the luma without a detour through
colours, and the number of frames only where the file has it; it does not decode what is before
the start of a selection.
"""

from bisect import bisect_left
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from itertools import chain, islice
from typing import Any, cast

import numpy as np
from phase_traj_ros.errors import SourceError
from phase_traj_ros.io.images.decoding import GreyImage
from phase_traj_ros.io.sources.base import Candidate, index_stamp_ns
from phase_traj_ros.io.sources.video import VideoClock, VideoFacts, VideoFile

# The first version that tells how a picture is rotated.
_LEAST_VERSION = 14
# A video that ends so much earlier than its header says was cut off, in seconds.
_CUT_OFF_S = 1.0
# The first plane of these formats is the luma, 8 bits a pixel.
_WITH_LUMA = frozenset({
    'gray', 'nv12', 'nv16', 'nv21', 'nv24', 'yuv410p', 'yuv411p', 'yuv420p', 'yuv422p', 'yuv440p',
    'yuv444p', 'yuvj411p', 'yuvj420p', 'yuvj422p', 'yuvj440p', 'yuvj444p'})
# Containers whose packets have no times of presentation; FFmpeg derives them from the order.
_WITHOUT_TIMES = frozenset({'asf', 'avi'})
# MP4 and its relatives, as FFmpeg names them.
_MP4 = 'mov,mp4,m4a,3gp,3g2,mj2'


def has_pyav() -> bool:
    """Return whether a PyAV that can be used is installed."""
    if find_spec('av') is None:
        return False
    import av
    return int(av.__version__.partition('.')[0]) >= _LEAST_VERSION


def _end(stream: Any) -> float:
    """Return the presentation time in seconds at which a stream ends, as it says; 0 if not."""
    if stream.duration:
        return float(((stream.start_time or 0) + stream.duration) * stream.time_base)
    # Matroska, as written by FFmpeg and mkvmerge.
    parts = stream.metadata.get('DURATION', '').split(':')
    try:
        hours, minutes, seconds = map(float, parts)
    except ValueError:
        return 0.0
    return 3600 * hours + 60 * minutes + seconds


def _packets(container: Any, stream: Any) -> Iterator[Any]:
    """Yield the packets of a stream."""
    # PyAV raises an IndexError after the last packet if the file has streams that it does not
    # announce, such as the GPS data of a dash camera.
    with suppress(IndexError):
        yield from container.demux(stream)


class PyavSource(VideoFile):
    """
    The frames of a video, read by PyAV.

    The stamps are the presentation times relative to the first frame, or those of a constant rate
    if fps is given. Frames before the start of the selection are not decoded. As many are counted
    as there are packets, some of which a decoder drops in a damaged file.
    """

    _first_ns = 0

    def _examine(self) -> VideoFacts:
        with self._stream() as (container, stream):
            first = next(chain.from_iterable(
                packet.decode() for packet in _packets(container, stream)), None)
            if first is None:
                raise SourceError(f'{self._path}: no frame of the video can be decoded')
            self._origin = first.pts or 0
            self._time_base = stream.time_base
            self._end = _end(stream)
            rate, frames = float(stream.average_rate or 0), stream.frames
            if rate and stream.duration and container.format.name == _MP4:
                # The edit list of a trimmed video hides frames.
                frames = min(frames, round(float(stream.duration * stream.time_base) * rate))
            return VideoFacts(
                rate, frames, (container.duration or 0) / 1e6,
                float(stream.sample_aspect_ratio or 1))

    def _candidates(self) -> Generator[Candidate, None, None]:
        number, from_pts, skipped = self._start_of_selection()
        clock, newest, begun = VideoClock(self._fps), self._origin, False
        for frame in self._shown(from_pts, skipped):
            pts = getattr(frame, 'pts', None)
            # A frame that cannot be decoded has no time: its neighbours tell where it belongs.
            begun = begun or from_pts is None or (pts is not None and pts >= from_pts)
            if not begun:
                continue
            newest = newest if pts is None else max(pts, newest)
            stamp_ns = clock.stamp_ns(self._position_ns(number, pts))
            yield Candidate(number, stamp_ns, partial(self._luma, frame, number))
            number += 1
        # The newest frame is shown for one period.
        lost_s = self._end - float(newest * self._time_base) - 1 / self._fps
        # A fragmented .mp4 declares the frames of its first fragment.
        if lost_s > _CUT_OFF_S and number > (self.frames.declared or 0):
            self.frames = replace(self.frames, declared=number + round(lost_s * self._fps))

    def _position_ns(self, number: int, pts: int | None) -> int | None:
        """Return when a frame is presented, by the given rate or as the file says."""
        if self._is_constant:
            return index_stamp_ns(number, self._fps)
        return None if pts is None else round(
            (pts - self._origin) * self._time_base * 1_000_000_000)

    def _start_of_selection(self) -> tuple[int, int | None, int]:
        """
        Find the start of the selection, without decoding.

        Return the number of its first frame, the presentation time of that, and the number of
        packets before the key frame that it needs; 0, None and 0 without a start, or if the file
        does not give the time of each frame.
        """
        times, key_frames, last_dts = [], [], None
        unknown = 0, None, 0
        if not self._selection.start_ns:
            return unknown
        with self._stream() as (container, stream):
            if container.format.name in _WITHOUT_TIMES:
                return unknown
            for index, packet in enumerate(_packets(container, stream)):
                if not packet.size:
                    continue
                if packet.pts is None or packet.dts is None:
                    return unknown
                if last_dts is None and not packet.is_keyframe:
                    # What comes before the first key frame may be shown or not.
                    return unknown
                if last_dts is not None and packet.dts < last_dts:
                    # In concatenated files, the times start again.
                    return unknown
                last_dts = packet.dts
                if packet.pts >= self._origin and not packet.is_discard:
                    times.append(packet.pts)
                if packet.is_keyframe:
                    key_frames.append((packet.pts, index))
        if not times:
            return unknown
        times.sort()
        positions = [self._position_ns(index, pts) or 0 for index, pts in enumerate(times)]
        number = min(bisect_left(positions, self._selection.start_ns), len(times) - 1)
        from_pts = times[number]
        needed = [index for pts, index in key_frames if pts <= from_pts]
        return number, from_pts, needed[-1] if needed else 0

    def _shown(self, from_pts: int | None, skipped: int) -> Iterator[Any]:
        """
        Return the frames, in the order in which they are shown.

        The first packets are skipped, unless the decoder needs them for the frame at ``from_pts``:
        some key frames do not show a whole picture.
        """
        if skipped and from_pts is not None:
            pictures = self._pictures(skipped)
            first = next(pictures, None)
            pts = getattr(first, 'pts', None)
            if pts is not None and pts <= from_pts:
                return chain([first], pictures)
        return self._pictures(0)

    def _pictures(self, skipped: int) -> Iterator[Any]:
        """Yield the frames of all packets but the first, and the error of what is not decoded."""
        import av
        with self._stream() as (container, stream):
            # Unlike a seek, this is exact in every container.
            for packet in islice(_packets(container, stream), skipped, None):
                try:
                    yield from packet.decode()
                except av.FFmpegError as error:
                    yield error

    @contextmanager
    def _stream(self) -> Iterator[tuple[Any, Any]]:
        """Open the file; yield it with its video stream."""
        import av
        try:
            with av.open(str(self._path)) as container:
                if not container.streams.video:
                    raise SourceError(f'{self._path} holds no video')
                stream = container.streams.video[0]
                stream.thread_type = 'AUTO'
                yield container, stream
        except (av.FFmpegError, OSError) as error:
            reason = ' '.join(str(getattr(error, 'strerror', None) or error).split())
            raise self._not_opened(reason) from error

    def _luma(self, frame: Any, number: int) -> GreyImage:
        if isinstance(frame, Exception):
            raise self._undecodable(number, f' ({frame})')
        grey = frame if frame.format.name in _WITH_LUMA else frame.reformat(format='gray')
        plane = grey.planes[0]
        rows = np.frombuffer(plane, np.uint8).reshape(-1, plane.line_size)
        image = self._with_square_pixels(cast('GreyImage', rows[:grey.height, :grey.width]))
        quarters = round(getattr(frame, 'rotation', 0) / 90) % 4
        return cast('GreyImage', np.ascontiguousarray(np.rot90(image, quarters)) if quarters
                    else image)
