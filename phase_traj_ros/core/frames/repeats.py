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
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.correlation.view import reduced
from phase_traj_ros.core.frames.tuning import TUNING


class RepeatDetector:
    """Keeps the newest frame that was used, and recognises its repetitions."""

    def __init__(self) -> None:
        """Make a detector without a frame: the next one is not a repetition."""
        self._encoding = ''
        self._frame: Frame | None = None
        self._halts = _HaltDetector()
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

    def _is_same(self, frame: Frame, interval_ns: int, encoding: str, by_motion: bool) -> bool:
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


class _HaltDetector:
    """
    Recognises repeated pictures of a video, after its motion has halted and continued once.

    Hardware encoders change a picture that they repeat by several grey levels, more than a slow
    robot changes it between two exposures. But a vehicle does not stop and start again within a
    quarter of a second.
    """

    def __init__(self) -> None:
        """Make a detector before the first pair."""
        self._moving = 0.0
        self._since_ns = 0
        self._halted = False
        self._expected = 0

    def update(
        self, before: Frame, after: Frame, interval_ns: int, *, change: float, same: bool,
    ) -> bool:
        """
        Return whether a frame ``after`` repeats the last one that was used, both (H, W) uint8.

        ``interval_ns`` is the time between them, ``change`` their mean difference in grey levels,
        and ``same`` whether they are known to be the same picture.
        """
        in_time = self._since_ns + interval_ns < TUNING.halt_ns
        halts = same or (in_time and change < TUNING.halt_share * self._moving
                         and _is_still(before, after))
        if in_time and self._halted and not halts:
            self._expected = TUNING.repeat_memory_frames
        repeated = same or (halts and self._expected > 0)
        self._halted = in_time and halts
        if not repeated:
            self._expected = max(self._expected - 1, 0)
            self._since_ns = self._since_ns + interval_ns if halts else 0
            self._moving = self._moving if halts else change
        return repeated


def _is_improved(frame: Frame, kept: Frame, interval_ns: int) -> bool:
    """Return whether a picture may have changed by what its encoder improved."""
    changed = _square_means(cv2.absdiff(frame, kept).astype(np.float32))
    most = TUNING.reencoded_max if interval_ns < TUNING.halt_ns else TUNING.frozen_max
    return (float(np.median(changed)) <= TUNING.reencoded_median and float(changed.max()) <= most
            and _shows_something(frame))


def _shows_something(frame: Frame) -> bool:
    return bool(frame.min() < frame.max())


def _is_still(before: Frame, after: Frame) -> bool:
    """Return whether hardly any square moves, by one step of Lucas and Kanade in each."""
    times = max(before.shape[1] // TUNING.still_width_px, 1)
    before, after = reduced(before, times, times), reduced(after, times, times)
    change = cv2.subtract(after, before, dtype=cv2.CV_32F)
    mean = cv2.addWeighted(before, 0.5, after, 0.5, 0.0)
    across = cv2.Sobel(mean, cv2.CV_32F, 1, 0, scale=1 / 8)
    down = cv2.Sobel(mean, cv2.CV_32F, 0, 1, scale=1 / 8)
    # The addition, noise of one grey level, keeps squares without texture still.
    xx, yy = _square_means(across * across) + 1.0, _square_means(down * down) + 1.0
    xy = _square_means(across * down)
    xt, yt = _square_means(across * change), _square_means(down * change)
    motion = np.hypot(yy * xt - xy * yt, xx * yt - xy * xt) / (xx * yy - xy * xy)
    texture = xx + yy
    textured = motion[texture >= np.median(texture)]
    # A covered lens shows nothing that could move.
    return bool(texture.max() > 2.0 and np.median(textured) < TUNING.still_px
                and np.percentile(textured, 90) < TUNING.still_max_px)


def _square_means(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the means of the squares of a picture (H, W), (H // 16, W // 16), at least (1, 1)."""
    size = [max(side // TUNING.square_px, 1) for side in reversed(values.shape)]
    return np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_AREA), np.float32)
