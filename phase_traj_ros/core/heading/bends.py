# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Bends, which include those that are too small for a turn, and their use to check the camera.

With a field of view that is too narrow, turns are measured too small, so some are taken for bends.
"""

from collections.abc import Iterable

from phase_traj_ros.core.calibration.field_of_view import FieldOfView, FieldOfViewEstimator
from phase_traj_ros.core.camera.in_use import CameraInUse
from phase_traj_ros.core.heading.turns import MIN_ANGLE_DEG, Turn

_LEAST_DEG = 20.0


class Bends:
    """Estimates the field of view from the angles of bends of 20 degrees or more."""

    def __init__(self) -> None:
        """Start without bends."""
        self._widest_deg = 0.0
        self._view: FieldOfViewEstimator | None = None

    @property
    def field_of_view(self) -> FieldOfView | None:
        """Return the field of view that fits the angles; None before the first bend."""
        return None if self._view is None else self._view.estimate

    def may_be_turns(self, camera: CameraInUse) -> bool:
        """Return whether a bend may have been a turn, within the uncertainty of the camera."""
        return self._widest_deg * camera.most_angle >= MIN_ANGLE_DEG

    def update(self, ended: Iterable[Turn], *, focal: float) -> list[float]:
        """
        Add bends that have ended, and return the angles in degrees of those that are large enough.

        ``focal`` is the focal length in use, in widths of the picture.
        """
        angles = [bend.angle_deg for bend in ended if abs(bend.angle_deg) >= _LEAST_DEG]
        for angle_deg in angles:
            self._widest_deg = max(self._widest_deg, abs(angle_deg))
            if self._view is None:
                self._view = FieldOfViewEstimator()
            self._view.add(angle_deg, focal=focal)
        return angles

    def restart(self) -> None:
        """Start again without any bends: a recording that is repeated adds no evidence."""
        self._widest_deg = 0.0
        self._view = None

    def scale(self, factor: float) -> None:
        """Multiply all angles so far, after a correction of the camera."""
        self._widest_deg *= factor
