# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Judges each pair of frames: its status, and the quality of its measurement.

Only ``judged`` decides. ``Judge`` provides its inputs: whether the vehicle stands
(``_is_standing``) and whether only areas fixed to the camera agree (``_only_fixed_agree``). The
distance of a standing pair is 0; that of others is measured on the road. Repeated pictures and
foreseen frames have no measurement to judge.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.correlation.phase_correlation import Frame, Shift
from phase_traj_ros.core.correlation.quality import Quality
from phase_traj_ros.core.fixed.fixed_areas import FixedAreas
from phase_traj_ros.core.fixed.tuning import TUNING as FIXED
from phase_traj_ros.core.heading.visual_compass import VisualCompass
from phase_traj_ros.core.measuring import Comparison
from phase_traj_ros.core.reliability.reason import Evidence
from phase_traj_ros.core.reliability.tuning import TUNING as RELIABILITY
from phase_traj_ros.core.road.tuning import TUNING as ROAD
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement
from phase_traj_ros.core.settings import CodeSource
from phase_traj_ros.core.status import PairStatus


def judged(
    pair: Comparison, *, blank: bool = False, fixed: bool = False, implausible: bool = False,
    by_yaw: bool = True,
) -> tuple[PairStatus, Evidence]:
    """
    Return the status of a pair before it is coded, and its evidence.

    ``blank``: the image holds only noise. ``fixed``: only fixed areas may have agreed, or they
    leave too little of the image. ``implausible``: the yaw was not measured, or is impossible for
    a vehicle. ``by_yaw``: the pair is coded by its yaw.
    """
    if pair.gap:
        return PairStatus.GAP, Evidence.APART
    if pair.quality is None:
        return PairStatus.REPRIMED, Evidence.APART
    if pair.quality is Quality.STILL:
        return PairStatus.STILL, Evidence.STILL
    if pair.quality is Quality.NOTHING:
        return PairStatus.NO_MEASUREMENT, Evidence.BLANK
    status = PairStatus.NO_MEASUREMENT if by_yaw and implausible else PairStatus.OK
    if blank:
        return status, Evidence.BLANK
    if fixed:
        return status, Evidence.FIXED
    if pair.agreement < RELIABILITY.min_agreement:
        return status, Evidence.SCATTERED
    return status, Evidence.JERKED if implausible else Evidence.TRUSTED


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict on a pair of frames."""

    status: PairStatus
    """Status of the pair before it is coded."""
    evidence: Evidence
    """Quality of its measurement."""
    yaw: YawMeasurement | None = None
    """The measurement to integrate, without the yaw if that is rejected; None without any."""
    areas_changed: bool = False
    """Whether ``Judge.excluded`` has changed."""


class Judge:
    """
    Judges the pairs of a drive.

    With ``auto``, it detects areas that are fixed to the camera, and rejects motion that only they
    show.
    """

    def __init__(self, source: CodeSource) -> None:
        """Make a judge that has seen no frame, for codes from ``source``."""
        self._guards = source is CodeSource.AUTO
        self._by_yaw = source is not CodeSource.SHIFT
        self._areas = FixedAreas()

    def reset(self) -> None:
        """Start again with the next frame; fixed areas stay known."""
        self._areas.interrupt()

    @property
    def excluded(self) -> NDArray[np.uint8] | None:
        """Return the mask of the fixed areas, (H, W): 0 where fixed; None if nothing is."""
        return self._areas.weights() if self._excludes else None

    def judge(
        self, picture: Frame, pair: Comparison, heading: VisualCompass | None, interval: float, *,
        speed: float | None = None,
    ) -> Verdict:
        """
        Judge the next pair, whose second frame is ``picture``, (H, W).

        Its yaw has to follow from the ``heading`` so far, None if that is not measured.
        ``interval`` is the time between the two frames in seconds, and ``speed`` that before them
        in heights of the camera per second, None if it is unknown.
        """
        shift = None if heading is None else heading.camera.shift_of(pair.yaw)
        if pair.cut:
            self._areas.interrupt()
        traffic = pair.yaw is not None and pair.yaw.is_traffic
        # Traffic that moves does not make the scene behind it fixed to the camera.
        changed = self.add_frame(picture, None if traffic else shift, interval)
        if pair.quality is Quality.STILL and not self._is_standing(
                pair.yaw, interval, 0.0 if heading is None else heading.tracker.rate):
            pair = replace(pair, quality=Quality.MEASURED)
        if traffic and pair.quality is Quality.MEASURED:
            pair = replace(pair, quality=Quality.STILL)
        yaw, fixed = pair.yaw, False
        if yaw is not None and shift is not None:
            if pair.quality is Quality.STILL:
                # A stationary vehicle does not turn, even if traffic passes by.
                yaw = replace(yaw, yaw=0.0)
            elif self._only_fixed_agree(yaw, shift):
                fixed = True
                if not (self._areas.sufficient and _slides_straight(yaw, speed)):
                    yaw = replace(yaw, yaw=None)
        status, evidence = judged(
            pair, blank=self._areas.blank, fixed=fixed, by_yaw=self._by_yaw,
            implausible=heading is not None and not heading.admits(yaw, interval))
        return Verdict(status, evidence, yaw, changed)

    def add_frame(self, picture: Frame, shift: Shift | None, interval: float) -> bool:
        """
        Take the next frame; return whether ``excluded`` has changed.

        ``shift`` is that since the previous frame, in pixels of the frame; None if the two cannot
        be compared.
        """
        if not self._guards:
            return False
        if shift is None:
            self._areas.interrupt()
            return self._areas.update(picture, 0.0)
        before = self._excludes
        # If too little of the image would remain, the mask stays as it was.
        changed = self._areas.update(
            picture, interval, turned=shift.dx) and self._areas.sufficient
        return changed and (before or self._excludes)

    def _is_standing(
        self, yaw: YawMeasurement | None, interval: float, before: float,
    ) -> bool:
        """
        Return whether a vehicle with a still picture stands.

        It drives if only the horizon is unchanged, if everything turns, or if a turn continues:
        ``before`` is the yaw rate of the previous pair.
        """
        turns = (
            yaw is not None and yaw.yaw is not None
            and abs(yaw.yaw) > ROAD.driving_yaw_rate * interval
            and (yaw.certain or (yaw.refined and before * yaw.yaw > 0.0
                                 and abs(before) > ROAD.driving_yaw_rate)))
        return not (self._areas.only_horizon_unchanged or (turns and self._areas.moving))

    def _only_fixed_agree(self, yaw: YawMeasurement, shift: Shift) -> bool:
        """Return whether only areas fixed to the camera may agree on the yaw."""
        # A scene that passes by is not fixed, however little of the image moves.
        passes = yaw.certain and yaw.motion is not None and yaw.motion.passing > FIXED.min_passing
        return not self._areas.sufficient or (
            not passes and self._areas.doubts(shift, agreed=yaw.refined))

    @property
    def _excludes(self) -> bool:
        return self._areas.share >= FIXED.min_masked


def _slides_straight(yaw: YawMeasurement, speed: float | None) -> bool:
    """Return whether the road slides by at this speed, and most blocks agree on one motion."""
    # On an open road and above a long bonnet, few blocks move.
    return (speed or 0.0) > FIXED.min_speed and yaw.agreement >= FIXED.sliding_agreement
