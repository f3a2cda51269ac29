# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Recognises repeated pictures of a video by motion that halts and continues.

Hardware encoders change a picture that they repeat by several grey levels, more than a slow robot
changes it between two exposures. But a vehicle does not stop and start again within a quarter of
a second.
"""

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.correlation.view import reduced
from phase_traj_ros.core.frames.tuning import TUNING


class HaltDetector:
    """Recognises repeated pictures of a video, after its motion has halted and continued once."""

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


def _is_still(before: Frame, after: Frame) -> bool:
    """Return whether hardly any square moves, by one step of Lucas and Kanade in each."""
    times = max(before.shape[1] // TUNING.still_width_px, 1)
    before, after = reduced(before, times, times), reduced(after, times, times)
    change = cv2.subtract(after, before, dtype=cv2.CV_32F)
    mean = cv2.addWeighted(before, 0.5, after, 0.5, 0.0)
    across = cv2.Sobel(mean, cv2.CV_32F, 1, 0, scale=1 / 8)
    down = cv2.Sobel(mean, cv2.CV_32F, 0, 1, scale=1 / 8)
    # The addition, noise of one grey level, keeps squares without texture still.
    xx, yy = square_means(across * across) + 1.0, square_means(down * down) + 1.0
    xy = square_means(across * down)
    xt, yt = square_means(across * change), square_means(down * change)
    motion = np.hypot(yy * xt - xy * yt, xx * yt - xy * xt) / (xx * yy - xy * xy)
    texture = xx + yy
    textured = motion[texture >= np.median(texture)]
    # A covered lens shows nothing that could move.
    return bool(texture.max() > 2.0 and np.median(textured) < TUNING.still_px
                and np.percentile(textured, 90) < TUNING.still_max_px)


def square_means(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the means of the squares of a picture (H, W), (H // 16, W // 16), at least (1, 1)."""
    size = [max(side // TUNING.square_px, 1) for side in reversed(values.shape)]
    return np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_AREA), np.float32)
