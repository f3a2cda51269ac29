# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The quality of the data of a replay: what is missing, and how well it was measured."""

from collections import Counter
from dataclasses import dataclass
from typing import Final

import numpy as np
from phase_traj_ros.io.replay.overview import Overview
from phase_traj_ros.io.replay.run import Replay

LOW_RESPONSE: Final = 0.02
"""Unrelated frames reach a response of 0.014 to 0.021 at 1241 x 376 pixels."""

# An interval of this many usual ones lacks a frame.
_DROPPED = 1.5


@dataclass(frozen=True, slots=True)
class DataHealth:
    """What a user should know before trusting a result."""

    frames: int
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
    statuses: tuple[tuple[str, int], ...]
    """Number of pairs for each status, the most frequent first."""
    repeated: int
    """Frames with the stamp or the picture of the previous one."""
    out_of_order: int
    """Frames dropped because their stamps are late, or far from those around them."""
    skipped: int
    """Frames that could not be read or used."""
    time_resets: int
    """How often the stamps went back; everything before the last time is dropped."""


def data_health(result: Replay, shown: Overview) -> DataHealth:
    """Return the quality of the data of ``result``; ``shown`` is its overview."""
    intervals = np.diff(shown.seconds, prepend=0.0)
    usual = float(np.median(intervals))
    late = intervals[intervals >= _DROPPED * usual] if usual > 0 else intervals[:0]
    measured = shown.response[np.isfinite(shown.response)]
    return DataHealth(
        frames=result.frames,
        seconds=float(shown.seconds[-1]),
        interval_s=usual,
        longest_interval_s=float(intervals.max()),
        dropped=int((np.rint(late / usual) - 1).clip(1).sum()) if len(late) else 0,
        response=float(np.median(measured)) if len(measured) else float('nan'),
        low_responses=int((measured < LOW_RESPONSE).sum()),
        statuses=tuple(Counter(update.status.value for update in result.updates).most_common()),
        repeated=result.counters.repeated,
        out_of_order=result.counters.dropped,
        skipped=result.counters.skipped,
        time_resets=result.counters.time_resets,
    )
