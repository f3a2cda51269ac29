# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Arrays that always begin at the same place of a cache line."""

import math

import numpy as np
from numpy.typing import NDArray

_LINE = 64


def aligned_zeros(shape: tuple[int, ...]) -> NDArray[np.float32]:
    """
    Return a float32 array of zeros, (shape), that begins at a multiple of 64 bytes.

    Vectorised loops treat what lies before the first such place on its own, and round it otherwise
    where they can multiply and add at once. With numpy's own arrays, which begin anywhere, the
    same frames would give shifts that differ in their last digit from run to run.
    """
    size = math.prod(shape) * np.dtype(np.float32).itemsize
    raw = np.zeros(size + _LINE, np.uint8)
    first = -raw.ctypes.data % _LINE
    return raw[first:first + size].view(np.float32).reshape(shape)
