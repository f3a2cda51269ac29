# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Bends, which include those that are too small for a turn.

With a field of view that is too narrow, turns are measured too small, so some are taken for bends.
"""

from collections.abc import Iterable

from phase_traj_ros.core.camera.in_use import CameraInUse
from phase_traj_ros.core.heading.turns import MIN_ANGLE_DEG, Turn

_LEAST_DEG = 20.0


class Bends:
    """Keeps the widest bend of 20 degrees or more."""

    def __init__(self) -> None:
        """Start without bends."""
        self._widest_deg = 0.0

    def may_be_turns(self, camera: CameraInUse) -> bool:
        """Return whether a bend may have been a turn, within the uncertainty of the camera."""
        return self._widest_deg * camera.most_angle >= MIN_ANGLE_DEG

    def update(self, ended: Iterable[Turn]) -> list[float]:
        """Add ended bends, and return the angles in degrees of those that are large enough."""
        angles = [bend.angle_deg for bend in ended if abs(bend.angle_deg) >= _LEAST_DEG]
        self._widest_deg = max([self._widest_deg, *map(abs, angles)])
        return angles

    def restart(self) -> None:
        """Start again without any bends: a recording that is repeated adds no evidence."""
        self._widest_deg = 0.0

    def scale(self, factor: float) -> None:
        """Multiply all angles so far, after a correction of the camera."""
        self._widest_deg *= factor
