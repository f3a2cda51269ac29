# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Checks cheaply whether the image moves as foreseen, on the mean of its rows.

One line of brightness over azimuth shows that the vehicle begins to turn, that an object passes
by, or that the scene has changed (Milford and Wyeth, "Mapping a suburb with a single camera using
a biologically inspired SLAM system", 2008). Near objects shift it by up to a pixel, so it does not
measure the yaw.
"""

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.correlation.phase_correlation import Frame
from phase_traj_ros.core.rotation.tuning import TUNING


class Scanline:
    """The line of one frame, with which those of the next ones are compared."""

    def __init__(self, projection: CylinderProjection, frame: Frame) -> None:
        """Keep the line of a frame (H, W)."""
        self._projection = projection
        self._line = _smooth(projection.scanline(frame))

    def shift_error(self, frame: Frame, foreseen: float) -> float | None:
        """
        Return how much farther than ``foreseen`` the image has moved to the right since.

        Both are in pixels of the cylinder. None if motion does not explain the line of the frame.
        The contrast, a shift and an expansion are fitted by least squares; the last is that of
        driving ahead.
        """
        after = _smooth(self._projection.scanline(frame))
        columns = np.arange(len(after), dtype=np.float64)
        margin = int(min(abs(foreseen), len(after) // 4)) + TUNING.scanline_px // 2
        part = slice(margin, len(after) - margin)
        before = np.interp(columns - foreseen, columns, self._line)[part]
        after = after[part] - after[part].mean()
        slope = np.gradient(before)
        ahead = columns[part] - len(columns) / 2
        models = np.stack([before - before.mean(), -slope, -slope * ahead])
        solvable, fit = cv2.solve(
            models @ models.T, models @ after[:, None], flags=cv2.DECOMP_CHOLESKY)
        if not solvable:
            return None
        rest = after - fit[:, 0] @ models
        explained = rest @ rest < TUNING.max_residual_share * (after @ after)
        return float(fit[1, 0]) if explained else None


def _smooth(line: NDArray[np.float32]) -> NDArray[np.float64]:
    return cv2.blur(line, (TUNING.scanline_px, 1)).ravel().astype(np.float64)
