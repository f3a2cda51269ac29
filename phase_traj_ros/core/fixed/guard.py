# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Examines what moves in a pair of frames: the world, traffic, or only what is not fixed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.phase_correlation import Frame, Shift
from phase_traj_ros.core.correlation.quality import Quality
from phase_traj_ros.core.fixed.fixed_areas import FixedAreas
from phase_traj_ros.core.fixed.tuning import TUNING
from phase_traj_ros.core.road.tuning import TUNING as ROAD
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement


@dataclass(frozen=True, slots=True)
class Findings:
    """What a pair of frames shows beside its motion."""

    quality: Quality | None
    """Quality of the pair, given the fixed areas and the traffic; None without any."""
    blank: bool
    """Whether the image holds only noise."""
    fixed: bool
    """Whether only areas fixed to the camera may agree on the yaw, or leave too little."""
    slides: bool
    """Whether the road slides by all the same, so that the yaw counts."""
    changed: bool
    """Whether ``FixedGuard.excluded`` has changed."""


class FixedGuard:
    """Detects the fixed areas of a drive, and what they explain."""

    def __init__(self) -> None:
        """Make a guard that has seen no frame."""
        self._areas = FixedAreas()
        self.excluded: NDArray[np.uint8] | None = None
        """Mask of the fixed areas to leave out, (H, W): 0 where fixed; None if nothing is."""

    def interrupt(self) -> None:
        """Do not compare the next frame with earlier ones; fixed areas stay known."""
        self._areas.interrupt()

    def start(self, picture: Frame) -> bool:
        """Take the first frame of a pair, (H, W); return whether ``excluded`` has changed."""
        return self._add(picture, None, 0.0)

    def examine(
        self, picture: Frame, yaw: YawMeasurement | None, quality: Quality | None,
        interval: float, *, speed: float | None = None, yaw_rate: float = 0.0,
    ) -> Findings:
        """
        Take the next frame, (H, W), and return what its pair shows.

        ``yaw`` and ``quality`` are those of the pair, None if it cannot be compared; ``interval``
        is its time in seconds. ``speed``, in camera heights per second, None if it is unknown, and
        ``yaw_rate``, in radians per second, are those before the pair.
        """
        traffic = yaw is not None and yaw.is_traffic
        # Traffic that moves does not make the scene behind it fixed to the camera.
        shift = None if yaw is None or traffic else yaw.shift
        changed = self._add(picture, shift, interval)
        if quality is Quality.STILL and not self._stands(yaw, interval, yaw_rate):
            quality = Quality.MEASURED
        if traffic and quality is Quality.MEASURED:
            quality = Quality.STILL
        fixed = slides = False
        if yaw is not None and quality is not Quality.STILL:
            fixed = self._only_fixed_agree(yaw)
            slides = fixed and self._slides(yaw, speed)
        return Findings(quality, self._areas.blank, fixed, slides, changed)

    def _add(self, picture: Frame, shift: Shift | None, interval: float) -> bool:
        """Take the next frame; return whether ``excluded`` has changed."""
        before = self.excluded
        if before is not None and before.shape != picture.shape:
            self.excluded = None
        if shift is None:
            self._areas.interrupt()
            self._areas.update(picture, 0.0)
        elif self._areas.update(picture, interval, turned=shift.dx) and self._areas.sufficient:
            # If too little of the image would remain, the mask stays as it was.
            self.excluded = (
                self._areas.weights() if self._areas.share >= TUNING.min_masked else None)
        return self.excluded is not before

    def _stands(self, yaw: YawMeasurement | None, interval: float, before: float) -> bool:
        """
        Return whether a vehicle with a still picture stands.

        It drives if only the horizon is unchanged, if everything turns, or if a turn continues:
        ``before`` is the yaw rate of the previous pair.
        """
        turns = (
            yaw is not None and yaw.yaw is not None
            and abs(yaw.yaw) > ROAD.driving_yaw_rate * interval
            and (yaw.certain or (yaw.motion is not None and before * yaw.yaw > 0.0
                                 and abs(before) > ROAD.driving_yaw_rate)))
        return not (self._areas.only_horizon_unchanged or (turns and self._areas.moving))

    def _only_fixed_agree(self, yaw: YawMeasurement) -> bool:
        """Return whether only areas fixed to the camera may agree on the yaw."""
        # A scene that passes by is not fixed, however little of the image moves.
        passes = yaw.certain and yaw.motion is not None and yaw.motion.passing > TUNING.min_passing
        return not self._areas.sufficient or (
            not passes and self._areas.doubts(yaw.shift, agreed=yaw.motion is not None))

    def _slides(self, yaw: YawMeasurement, speed: float | None) -> bool:
        """Return whether the road slides by at this speed, and most blocks agree on one motion."""
        # On an open road and above a long bonnet, few blocks move.
        return (self._areas.sufficient and abs(speed or 0.0) > TUNING.min_speed
                and yaw.agreement >= TUNING.sliding_agreement)
