# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Prepares a frame: checks it, and converts it to the grey levels in which it is measured."""

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.phase_correlation import check_form, Frame, mean_and_deviation
from phase_traj_ros.core.frames.tuning import TUNING


def prepare(frame: Frame) -> NDArray[np.uint8]:
    """
    Return a frame in 8 bits, (H, W), which does not change if the caller changes the frame.

    uint8 is copied as it is; a read-only array is not copied. The unit and the zero of other types
    are unknown (thermal cameras have an offset), so their mean and contrast are set: the result
    does not depend on the gain and the offset of the camera.

    Raises
    ------
    FrameError
        The frame is not (H, W), its type is not uint8, uint16 or float32, it is smaller than
        8x8, or it holds NaN or infinity.

    """
    check_form(frame)
    if frame.dtype == np.uint8:
        return np.array(frame) if frame.flags.writeable else frame  # type: ignore[return-value]
    mean, deviation = mean_and_deviation(frame)
    gain = TUNING.contrast / deviation if deviation > 0.0 else 0.0
    levels = np.float32(gain) * (frame.astype(np.float32) - np.float32(mean))
    return np.asarray(np.clip(np.rint(levels + np.float32(TUNING.mean)), 0, 255), np.uint8)
