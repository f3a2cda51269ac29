# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Judges each pair of frames, once: what its measurement is worth, and why.

``judged`` is the only place that decides it; ``Judge`` collects what it needs to know: whether the
vehicle stands (``_stands``) and whether only what is fixed to the camera agrees
(``_only_fixed_agree``). The distance of a pair that stands is 0; of others, the road decides. A
frame that repeats a picture or is foreseen has no measurement to judge.
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
    Return the status of a pair before it is coded, and what it is worth for the result.

    ``blank``: the image holds only noise. ``fixed``: only fixed areas may have agreed, or too
    little else is left. ``implausible``: the yaw was not measured, or no vehicle turns like that.
    ``by_yaw``: the pair is coded by its yaw.
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
    if pair.agreement < RELIABILITY.agreeing:
        return status, Evidence.SCATTERED
    return status, Evidence.JERKED if implausible else Evidence.TRUSTED


@dataclass(frozen=True, slots=True)
class Verdict:
    """The judgement on a pair of frames."""

    status: PairStatus
    """Status of the pair before it is coded."""
    evidence: Evidence
    """What it is worth for the result."""
    yaw: YawMeasurement | None = None
    """The measurement to integrate, without the yaw if that is rejected; None without any."""
    areas_changed: bool = False
    """Whether ``Judge.left_out`` has changed."""


class Judge:
    """
    Judges the pairs of a drive.

    In ``auto`` it detects areas that are fixed to the camera, and rejects what only they show.
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
    def left_out(self) -> NDArray[np.uint8] | None:
        """Return the mask of the fixed areas, (H, W): 0 where fixed; None if nothing is."""
        return self._areas.weights() if self._leaves_out else None

    def judge(
        self, picture: Frame, pair: Comparison, heading: VisualCompass | None, interval: float,
    ) -> Verdict:
        """
        Judge the next pair, whose second frame is ``picture``, (H, W).

        Its yaw has to follow from the ``heading`` so far, None if that is not measured.
        ``interval`` is the time between the two frames in seconds.
        """
        shift = None if heading is None else heading.shift_of(pair.yaw)
        if pair.cut:
            self._areas.interrupt()
        changed = self.look(picture, shift, interval)
        if pair.quality is Quality.STILL and not self._stands(
                pair.yaw, interval, 0.0 if heading is None else heading.tracker.rate):
            pair = replace(pair, quality=Quality.MEASURED)
        yaw, fixed = pair.yaw, False
        if yaw is not None and shift is not None:
            if pair.quality is Quality.STILL:
                # A stationary vehicle does not turn, whatever passes by.
                yaw = replace(yaw, yaw=0.0)
            elif self._only_fixed_agree(yaw, shift):
                yaw, fixed = replace(yaw, yaw=None), True
        status, evidence = judged(
            pair, blank=self._guards and self._areas.blank, fixed=fixed, by_yaw=self._by_yaw,
            implausible=heading is not None and not heading.admits(yaw, interval))
        return Verdict(status, evidence, yaw, changed)

    def look(self, picture: Frame, shift: Shift | None, interval: float) -> bool:
        """
        Take the next frame; return whether ``left_out`` has changed.

        ``shift`` is that since the previous frame, in pixels of the frame; None if the two cannot
        be compared.
        """
        if not self._guards:
            return False
        if shift is None:
            self._areas.interrupt()
            return self._areas.update(picture, 0.0)
        before = self._leaves_out
        # If too little of the image would remain, the mask stays as it was.
        changed = self._areas.update(
            picture, interval, turned=shift.dx) and self._areas.sufficient
        return changed and (before or self._leaves_out)

    def _stands(
        self, yaw: YawMeasurement | None, interval: float, before: float,
    ) -> bool:
        """
        Return whether a vehicle stands whose picture is still.

        It drives if all that does not move is the horizon, or if everything turns, or if a turn
        goes on: ``before`` is the yaw rate of the previous pair.
        """
        turns = (yaw is not None and yaw.yaw is not None and abs(yaw.yaw) > ROAD.turning * interval
                 and (yaw.certain or (yaw.refined and before * yaw.yaw > 0.0
                                      and abs(before) > ROAD.turning)))
        return not (self._areas.far or (turns and self._areas.moving))

    def _only_fixed_agree(self, yaw: YawMeasurement, shift: Shift) -> bool:
        """Return whether only what is fixed to the camera may agree on the yaw."""
        # What passes by is not fixed, however little of the rest of the image moves.
        passes = yaw.certain and yaw.motion is not None and yaw.motion.passing > FIXED.passing
        return self._guards and (not self._areas.sufficient or (
            not passes and self._areas.doubts(shift, agreed=yaw.refined)))

    @property
    def _leaves_out(self) -> bool:
        return self._areas.share >= FIXED.least_masked
