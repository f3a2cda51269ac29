# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Keeps frames in memory for a second pass, unless there are too many."""

from collections.abc import Generator
from contextlib import closing
from dataclasses import replace

from phase_traj_ros.io.sources.base import Entry, FrameSource, StampedFrame
from phase_traj_ros.io.sources.prefetch import prefetch

_MOST_BYTES = 64 << 20


class KeptFrames:
    """
    The frames of a source, to be iterated over more than once.

    A drive that fits into the memory limit is decoded once, a longer one on each pass; of one
    that is known to be longer, nothing is kept.
    """

    def __init__(self, source: FrameSource, *, most_bytes: int = _MOST_BYTES) -> None:
        """Keep at most ``most_bytes`` bytes of the frames of ``source``."""
        self._source = source
        self._most_bytes = most_bytes
        self._kept: list[Entry] | None = None

    def once(self) -> Generator[Entry, None, None]:
        """Yield all frames, and release them."""
        kept, self._kept = self._kept, None
        if kept is not None:
            yield from kept
            return
        with closing(prefetch(self._source.entries())) as frames:
            yield from frames

    def keeping(self) -> Generator[Entry, None, None]:
        """Yield all frames, and keep them for the next pass if they fit."""
        kept: list[Entry] | None = []
        size, expected = 0, self._source.frame_count or 0
        with closing(self.once()) as frames:
            for frame in frames:
                if kept is not None:
                    one = frame.image.nbytes if isinstance(frame, StampedFrame) else 0
                    size += one
                    kept.append(_alone(frame))
                    if max(size, expected * one) > self._most_bytes:
                        kept = None
                yield frame
        self._kept = kept


def _alone(entry: Entry) -> Entry:
    """Return an entry without the colours that a decoder keeps beside the luma."""
    if not isinstance(entry, StampedFrame):
        return entry
    image = entry.image.copy()
    image.flags.writeable = False
    return replace(entry, image=image)
