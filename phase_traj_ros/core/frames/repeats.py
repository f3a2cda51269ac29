# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Detects a frame that repeats the picture of an earlier one.

A video with a constant frame rate repeats pictures if the camera was slower, and a broken camera
repeats one picture forever. Such a frame measures nothing. The pictures of a standing vehicle
differ by the noise of the sensor.
"""

import math

import cv2
import numpy as np
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.frames.halts import HaltDetector, square_means
from phase_traj_ros.core.frames.tuning import TUNING


class RepeatDetector:
    """Keeps the newest frame that was used, and recognises its repetitions."""

    def __init__(self) -> None:
        """Make a detector without a frame."""
        self.forget()

    def forget(self) -> None:
        """Forget the frame: the next one is not a repetition."""
        self._encoding = ''
        self._frame: Frame | None = None
        self._halts = HaltDetector()
        self._video_interval_ns = self._repeats = 0
        self._frames_since_repeat = TUNING.repeat_memory_frames
        self._repeats_before: int | None = None

    @property
    def deviation_ns(self) -> float:
        """
        Return the standard deviation of the time between two exposures, by their stamps.

        The stamps of a video that repeats pictures are not those of the camera. Both exposures are
        up to one video interval earlier than their stamps: the difference of two uniform errors.
        """
        if self._frames_since_repeat >= TUNING.repeat_memory_frames:
            return 0.0
        return self._video_interval_ns / math.sqrt(6.0)

    def is_repeated(
        self, frame: Frame, interval_ns: int, *, encoding: str = '', by_motion: bool = False,
    ) -> bool:
        """
        Return whether a frame (H, W) is the one that was kept, or was taken at the same time.

        ``interval_ns`` is the time since that frame. uint8 frames may differ by the noise of an
        encoder; others must be identical. A constant frame, as of a covered lens, is not repeated.
        With ``by_motion``, pictures of any encoder are recognised, by those before them.
        """
        repeated = self._is_same(frame, interval_ns, encoding, by_motion)
        if repeated and interval_ns >= TUNING.same_time_ns:
            if self._repeats == 0:
                # Of several repetitions, the first is one interval after the frame.
                self._video_interval_ns = interval_ns
            self._repeats += 1
        return repeated

    def keep(self, frame: Frame, *, encoding: str = '') -> None:
        """Keep a frame that is used; it must not change afterwards."""
        if self._frame is not None:
            even = self._repeats_before in (None, self._repeats)
            self._frames_since_repeat = self._frames_since_repeat + 1 if even else 0
            self._repeats_before, self._repeats = self._repeats, 0
        self._frame, self._encoding = frame, encoding

    def _is_same(
        self, frame: Frame, interval_ns: int, encoding: str, by_motion: bool,
    ) -> bool:
        kept = self._frame
        if (kept is None or encoding != self._encoding or kept.shape != frame.shape
                or kept.dtype != frame.dtype):
            return False
        if interval_ns < TUNING.same_time_ns:
            return True
        if frame.dtype != np.uint8:
            return np.array_equal(frame, kept) and _shows_something(frame)
        # Most frames differ already in a few of their rows.
        change = cv2.mean(cv2.absdiff(frame[::TUNING.square_px], kept[::TUNING.square_px]))[0]
        same = change <= 4.0 * TUNING.reencoded_median and _is_improved(frame, kept, interval_ns)
        if not by_motion:
            return same
        return self._halts.update(kept, frame, interval_ns, change=change, same=same)


def _is_improved(frame: Frame, kept: Frame, interval_ns: int) -> bool:
    """Return whether a picture may have changed by what its encoder improved."""
    changed = square_means(cv2.absdiff(frame, kept).astype(np.float32))
    most = TUNING.reencoded_max if interval_ns < TUNING.halt_ns else TUNING.frozen_max
    return (float(np.median(changed)) <= TUNING.reencoded_median and float(changed.max()) <= most
            and _shows_something(frame))


def _shows_something(frame: Frame) -> bool:
    return bool(frame.min() < frame.max())
