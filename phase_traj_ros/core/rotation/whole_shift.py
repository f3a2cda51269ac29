# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The shift of the image as a whole on the cylinder, by phase correlation."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.projection import CylinderProjection
from phase_traj_ros.core.correlation.phase_correlation import MIN_SIDE, PhaseCorrelator, Shift
from phase_traj_ros.core.correlation.view import View
from phase_traj_ros.core.rotation.tuning import TUNING


class WholeShift:
    """
    Correlates each picture of the cylinder with the previous one.

    It uses a coarser picture than the blocks. All shifts are in pixels of the cylinder.
    """

    def __init__(self, projection: CylinderProjection, mask: NDArray[np.float32] | None) -> None:
        """Make a meter; ``mask`` is the weight of each pixel of the cylinder, 0 to 1, or None."""
        halved = (projection.px_per_rad > TUNING.shift_px_per_rad
                  and min(projection.shape) >= 2 * MIN_SIDE)
        self._view = View(decimation=2 if halved else 1)
        self.correlator = PhaseCorrelator(mask=None if mask is None else self._view.of(mask))
        """Correlator of the pictures, reduced."""

    def update(self, picture: NDArray[np.uint8]) -> Shift | None:
        """Return the shift from the previous picture to this one; None if there is no pair."""
        shift = self.correlator.update(self._view.of(picture))
        return None if shift is None else self._view.full_shift(shift)

    def second_peak(self) -> Shift:
        """Return the shift of the second peak; see ``PhaseCorrelator.second_peak``."""
        return self._view.full_shift(
            self.correlator.second_peak(apart=TUNING.peak_distance_px // self._view.decimation))

    def of_scene(self, shift: Shift, *, moves: bool) -> Shift | None:
        """
        Return the shift of the scene in the newest pair; None if it is not significant.

        It is the ``shift`` of the pair, or if the scene ``moves`` and that is near zero, as of a
        pattern that is fixed to the camera, the second peak.
        """
        if moves and max(abs(shift.dx), abs(shift.dy)) <= TUNING.zero_px:
            shift = self.second_peak()
        is_significant = (abs(shift.dy) < TUNING.max_shake_px
                          and self.significance(shift) >= TUNING.min_significance)
        return shift if is_significant else None

    def significance(self, shift: Shift) -> float:
        """Return the significance of a shift; see ``PhaseCorrelator.significance``."""
        times = self._view.decimation
        return self.correlator.significance(
            replace(shift, dx=shift.dx / times, dy=shift.dy / times))
