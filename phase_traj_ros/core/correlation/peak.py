# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Locates the peak of a correlation map to a fraction of a pixel."""

import math

import numpy as np
from numpy.typing import NDArray


def refine(line: NDArray[np.float32], peak: int) -> float:
    """
    Return the position of the peak along a cyclic line through it, in pixels.

    A shift by whole pixels and a fraction d gives a peak of the form sin(pi x) / (pi x) about
    the true position (the Dirichlet kernel; cf. Foroosh, Zerubia, Berthod, "Extension of phase
    correlation to subpixel registration", 2002). For this form, the difference of the two
    neighbours divided by the peak is q = 2 d / (1 - d**2), which is solved for d. The difference
    cancels whatever surrounds the peak evenly, such as the broad foot caused by forward motion.
    """
    length = len(line)
    centre = float(line[peak])
    right, left = float(line[(peak + 1) % length]), float(line[peak - 1])
    ratio = (right - left) / centre if centre > 0.0 else 0.0
    fraction = ratio / (1.0 + math.sqrt(1.0 + ratio * ratio))
    position = peak if peak < length - peak else peak - length
    return position + min(max(fraction, -0.5), 0.5)
