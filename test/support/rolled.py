# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames of a texture that moves sideways by known shifts."""

from pathlib import Path

import cv2
import numpy as np
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.synthetic.degradations import sensor_noise

RATE_NS = 10**8
START_NS = 1_700_000_000 * 10**9
_RNG = np.random.default_rng(7)
TEXTURE = cv2.GaussianBlur(_RNG.integers(0, 256, (96, 160), dtype=np.uint8), (0, 0), 1.5)

SHIFTS = [0, 0, 0, 30, 30, 30, 0, 0, 0, -40, -40, 0, 0, 0]
"""A left turn of three pairs, then a right turn of two."""
MOVEMENT = [1, 1, 1, 0, 3, 3, 1, 1, 1, 2, 3, 1, 1, 1]
DIRECTION = [1, 1, 1, 0, 0, 0, 0, 1, 1, 1, 1]


def rolled_frames(shifts=SHIFTS, *, start_ns=START_NS, rate_ns=RATE_NS):
    """
    Return frames, one more than ``shifts``; each shift is relative to the previous frame.

    They have the noise of a sensor, so none is repeated.
    """
    places = np.cumsum([0, *shifts])
    return [
        StampedFrame(
            sensor_noise(np.roll(TEXTURE, int(place), axis=1), sigma=1.0, seed=index),
            start_ns + index * rate_ns)
        for index, place in enumerate(places)]


def write_rolled(folder: Path, shifts=SHIFTS) -> Path:
    """Write the frames as a folder of pictures; return it."""
    folder.mkdir(parents=True)
    for index, frame in enumerate(rolled_frames(shifts)):
        cv2.imwrite(str(folder / f'{index:04}.png'), frame.image)
    return folder
