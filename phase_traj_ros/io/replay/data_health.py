# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The quality of the data of a replay: what is missing, and how well it was measured."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from phase_traj_ros.io.replay.overview import Overview

LOW_RESPONSE: Final = 0.02
"""Unrelated frames reach a response of 0.014 to 0.021 at 1241 x 376 pixels."""

# An interval of this many usual ones lacks a frame.
_DROPPED = 1.5


@dataclass(frozen=True, slots=True)
class DataHealth:
    """What a user should know of times and responses before trusting a result."""

    seconds: float
    """Duration from the first frame to the last."""
    interval_s: float
    """Median time between two frames."""
    longest_interval_s: float
    dropped: int
    """Missing frames, one or more for each interval of 1.5 times the median or longer."""
    response: float
    """Median response; NaN if nothing was measured."""
    low_responses: int
    """Pairs with a response below ``LOW_RESPONSE``."""


def data_health(shown: Overview) -> DataHealth:
    """Return the quality of the data of a replay, given its overview."""
    intervals = np.diff(shown.seconds, prepend=0.0)
    usual = float(np.median(intervals))
    late = intervals[intervals >= _DROPPED * usual] if usual > 0 else intervals[:0]
    measured = shown.response[np.isfinite(shown.response)]
    return DataHealth(
        seconds=float(shown.seconds[-1]),
        interval_s=usual,
        longest_interval_s=float(intervals.max()),
        dropped=int((np.rint(late / usual) - 1).clip(1).sum()) if len(late) else 0,
        response=float(np.median(measured)) if len(measured) else float('nan'),
        low_responses=int((measured < LOW_RESPONSE).sum()),
    )
