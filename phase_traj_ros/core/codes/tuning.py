# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the codes, in physical units."""

from dataclasses import dataclass
import math


@dataclass(frozen=True, slots=True, kw_only=True)
class CodesTuning:
    """Tuning of the codes and of the hint; not for users. Shares are from 0 to 1."""

    min_yaw_rate: float = math.radians(5.0)
    """Yaw rate above which the vehicle counts as yawing, in radians per second."""
    hysteresis: float = 6.0 / 90.0
    """How far the heading has to pass the border of its sector to leave it, in sectors: 6 degrees
    of 90. If the field of view is 10 % too narrow, three right angles to the same side are
    measured 36 degrees too small. They are still three, as 36 degrees and the hysteresis are below
    45."""

    # The hint for a threshold that does not fit.
    min_pairs: int = 20
    """With fewer pairs, there is no hint."""
    lasting_pairs: int = 5
    """Smallest number of pairs that a turn lasts."""
    min_turn_speed: float = 0.08
    """A lasting shift counts as a turn if it crosses this share of the width per second. A camera
    of 130 degrees that turns by 20 degrees per second sees that much."""
    max_beyond: float = 0.4
    """Share of the pairs beyond the threshold that is too much for turns."""
    min_flickers: int = 6
    """The codes flicker if there are this many turns..."""
    short_turn_pairs: int = 2
    """...and at most this many pairs..."""
    max_short: float = 0.5
    """...is what this share of them lasts."""
    threshold_share: float = 0.5
    """A good threshold, as a share of the largest lasting shift."""


TUNING = CodesTuning()
