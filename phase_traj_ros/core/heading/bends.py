# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Bends, which include those that are too small for a turn, and their use to check the camera.

With a field of view that is too narrow, turns are measured too small, so some are taken for bends.
"""

from phase_traj_ros.core.calibration.field_of_view import FieldOfView, FieldOfViewEstimator
from phase_traj_ros.core.camera.in_use import CameraInUse
from phase_traj_ros.core.heading.turns import MIN_ANGLE_DEG, TurnDetector

_LEAST_DEG = 20.0


class Bends:
    """Finds bends of 20 degrees or more, and estimates the field of view from their angles."""

    def __init__(self) -> None:
        """Make a detector that has seen no frame."""
        self._detector = TurnDetector(min_angle_deg=_LEAST_DEG)
        self._widest_deg = 0.0
        self._view: FieldOfViewEstimator | None = None

    @property
    def field_of_view(self) -> FieldOfView | None:
        """Return the field of view that fits the angles; None before the first bend."""
        return None if self._view is None else self._view.estimate

    def may_be_turns(self, camera: CameraInUse) -> bool:
        """Return whether a bend may have been a turn, within the uncertainty of the camera."""
        return self._widest_deg * camera.most_angle >= MIN_ANGLE_DEG

    def start(self, stamp_ns: int) -> None:
        """Record the stamp of the first frame."""
        self._detector.update(stamp_ns, 0.0)

    def update(self, stamp_ns: int, heading: float, *, focal: float) -> list[float]:
        """
        Add a pair, and return the angles in degrees of the bends that have ended.

        Parameters
        ----------
        stamp_ns
            Stamp of its second frame.
        heading
            Heading at this frame in radians, positive to the left.
        focal
            Focal length in use, in widths of the picture.

        """
        angles = [bend.angle_deg for bend in self._detector.update(stamp_ns, heading)]
        for angle_deg in angles:
            self._widest_deg = max(self._widest_deg, abs(angle_deg))
            if self._view is None:
                self._view = FieldOfViewEstimator()
            self._view.add(angle_deg, focal=focal)
        return angles

    def cut(self) -> None:
        """Discard a bend in progress: its final angle is not known."""
        self._detector.cut()

    def restart(self) -> None:
        """Start again without any bends: a recording that is repeated adds no evidence."""
        self._detector.reset()
        self._widest_deg = 0.0
        self._view = None

    def scale(self, factor: float) -> None:
        """Multiply all angles so far, after a correction of the camera."""
        self._widest_deg *= factor
        self._detector.scale(factor)
