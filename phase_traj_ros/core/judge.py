# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Judges each pair of frames by its measurements: its status, its evidence, and the yaw to use.

Repeated pictures and foreseen frames have no measurement to judge.
"""

from dataclasses import dataclass, replace

from phase_traj_ros.core.correlation.quality import Quality
from phase_traj_ros.core.measuring import Comparison
from phase_traj_ros.core.reliability.reason import Evidence
from phase_traj_ros.core.reliability.tuning import TUNING
from phase_traj_ros.core.road.travel import TravelState
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement
from phase_traj_ros.core.status import PairStatus


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict on a pair of frames."""

    status: PairStatus
    """Status of the pair before it is coded."""
    evidence: Evidence
    """Quality of its measurement."""
    yaw: YawMeasurement | None = None
    """The measurement to integrate, without the yaw if that is rejected; None without any."""


def judge(pair: Comparison, *, admitted: bool = True, by_yaw: bool = True) -> Verdict:
    """
    Return the verdict on a pair.

    ``admitted``: the heading admits its yaw as possible for a vehicle. ``by_yaw``: the pair is
    coded by its yaw.
    """
    yaw = pair.yaw
    if pair.gap:
        return Verdict(PairStatus.GAP, Evidence.APART, yaw)
    if pair.quality is Quality.STILL:
        # A stationary vehicle does not turn, even if traffic passes by.
        return Verdict(PairStatus.STILL, Evidence.STILL, yaw and replace(yaw, yaw=0.0))
    if yaw is not None and pair.fixed and not pair.slides:
        yaw, admitted = replace(yaw, yaw=None), False
    if pair.quality is None:
        return Verdict(PairStatus.REPRIMED, Evidence.APART, yaw)
    if pair.quality is Quality.NOTHING:
        return Verdict(PairStatus.NO_MEASUREMENT, Evidence.BLANK, yaw)
    return Verdict(_status(pair, admitted, by_yaw), _evidence(pair, admitted), yaw)


def _status(pair: Comparison, admitted: bool, by_yaw: bool) -> PairStatus:
    if not by_yaw:
        return PairStatus.OK
    if not admitted:
        return PairStatus.NO_MEASUREMENT
    stands = pair.travel is not None and pair.travel.state is TravelState.STANDING
    return PairStatus.STILL if stands else PairStatus.OK


def _evidence(pair: Comparison, admitted: bool) -> Evidence:
    if pair.blank:
        return Evidence.BLANK
    if pair.fixed:
        return Evidence.FIXED
    if pair.agreement < TUNING.min_agreement:
        return Evidence.SCATTERED
    return Evidence.TRUSTED if admitted else Evidence.JERKED
