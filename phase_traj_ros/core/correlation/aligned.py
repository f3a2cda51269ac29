# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Arrays that always start on a cache line boundary."""

import math

import numpy as np
from numpy.typing import NDArray

_LINE = 64


def aligned_zeros(shape: tuple[int, ...]) -> NDArray[np.float32]:
    """
    Return a float32 array of zeros of ``shape`` that starts at a multiple of 64 bytes.

    Vectorised loops process the elements before the first aligned address separately, and round
    them differently where they can fuse multiply and add. Arrays of numpy start at any address, so
    the same frames would give shifts that differ in the last digit from run to run.
    """
    size = math.prod(shape) * np.dtype(np.float32).itemsize
    raw = np.zeros(size + _LINE, np.uint8)
    first = -raw.ctypes.data % _LINE
    return raw[first:first + size].view(np.float32).reshape(shape)
