# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the reliability monitor, in physical units."""

from dataclasses import dataclass
import math


@dataclass(frozen=True, slots=True, kw_only=True)
class ReliabilityTuning:
    """Tuning of the verdict on a drive; not for users. Shares are from 0 to 1."""

    window_ns: int = 60_000_000_000
    """The verdict is on this time, ..."""
    part_ns: int = 1_000_000_000
    """...which is kept in parts of this length."""
    min_pairs: int = 10
    """With fewer pairs, no cause can be given."""
    min_agreement: float = 0.3
    """Share of the blocks that has to agree in a trusted pair."""
    min_trusted: float = 0.5
    """Share of the moving pairs that has to be trusted."""
    min_cause_share: float = 0.2
    """A cause that spoils this share of the pairs is given as a reason."""
    max_fixed: float = 0.3
    """Above this share of pairs spoilt by a fixed pattern, it may have affected the others too."""
    max_cuts: float = 0.1
    """Cuts per pair: a scene of a few frames does not show a turn."""
    max_missed: float = math.radians(15.0)
    """Standard deviation of the corrections of bridged yaws: above it, a turn may be lost."""
    low_rate_s: float = 0.25
    """Above this interval, a low frame rate explains why blocks do not agree."""

    frozen_ns: int = 1_000_000_000
    """A camera that repeats one picture for longer is frozen."""
    unmeasured_ns: int = 1_000_000_000
    """What is not measured for longer is unknown: a car may have braked by 8 m/s, or turned."""
    unclear_ns: int = 1_000_000_000
    """A road is unclear if a more significant other motion recurs within this time."""
    scene_nearer: float = 3.0
    """So it is if what is near seems to be nearer by this factor than usual..."""
    scene_slower: float = 2.0
    """...and the road slower by this: on 36 real drives only where its speed was wrong..."""
    scene_s: float = 1.0
    """...in the mean over this time in seconds..."""
    usual_scene_s: float = 8.0
    """...compared with that over this time (with 20 s, a village after open country seemed to be
    one, at 5 Hz)..."""
    min_usual_scene_s: float = 2.0
    """...or this at least."""
    min_scene_speed: float = 0.5
    """Slower speeds, in metres or camera heights per second, are taken for this one."""
    lost_ns: int = 1_000_000_000
    """A longer gap than this..."""
    lost_intervals: int = 2
    """...and than this many usual intervals is a lost part of the drive."""

    max_unreliable: float = 0.05
    """Share of a drive, or of the window, that may be unreliable."""
    max_spans: int = 500
    """Number of spans that are kept for each reason; then the closest ones are joined."""


TUNING = ReliabilityTuning()
