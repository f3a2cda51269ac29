# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A lorry that crosses in front of a standing vehicle."""

import cv2
import numpy as np


def halted(frame, pairs, *, seed=5):
    """Yield the frame of a standing vehicle, with the noise of the sensor."""
    rng = np.random.default_rng(seed)
    for _ in range(pairs):
        yield np.clip(frame + rng.normal(0.0, 1.5, frame.shape), 0, 255).astype(np.uint8)


def crossing(frame, *, width, height, step, top=0.1, wait=10, seed=3):
    """Yield the frames of a standing vehicle in front of which a lorry of these shares passes."""
    rows, columns = frame.shape
    length, top, bottom = round(width * columns), round(top * rows), round((top + height) * rows)
    noise = np.random.default_rng(seed).integers(0, 255, (bottom - top, length)).astype(np.uint8)
    lorry = cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 3), None, 0, 255, cv2.NORM_MINMAX)
    pairs = wait + (columns + length) // abs(step)
    for number, picture in enumerate(halted(frame, pairs, seed=seed)):
        way = max(number - wait, 0) * abs(step)
        begin = way - length if step > 0 else columns - way
        left, right = max(begin, 0), min(begin + length, columns)
        if right > left:
            picture[top:bottom, left:right] = lorry[:, left - begin:right - begin]
        yield picture
