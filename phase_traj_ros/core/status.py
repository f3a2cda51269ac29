# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The status of a pair of frames; it is decided here only."""

from enum import Enum

from phase_traj_ros.core.codes.chain import Step
from phase_traj_ros.core.correlation.quality import Worth


class PairStatus(Enum):
    """The reason for the movement code of a pair."""

    OK = 'ok'
    """Measured and judged: forward, or the pair on which a turn begins."""
    TURNING = 'turning'
    """Measured: a turn that began earlier continues."""
    STILL = 'still'
    """The vehicle is stationary: only noise and traffic move in the image."""
    NO_MEASUREMENT = 'no_measurement'
    """The two frames are unrelated, or one of them has no content."""
    GAP = 'gap'
    """The interval between the two frames exceeds the limit."""
    REPRIMED = 'reprimed'
    """The size or encoding of the frames or a setting changed, so the pair cannot be compared."""
    REPEATED = 'repeated'
    """Both frames show the same picture: nothing is measured, the next pair covers the time."""

    @property
    def judged(self) -> bool:
        """Return whether the pair was measured and judged, so that the path continues with it."""
        return self in (PairStatus.OK, PairStatus.TURNING)

    @property
    def ends_turn(self) -> bool:
        """Return whether the pair separates the next ones from earlier ones and ends a turn."""
        return self in (PairStatus.GAP, PairStatus.REPRIMED)

    def coded(self, step: Step) -> 'PairStatus':
        """Return the status after the pair has been coded."""
        return PairStatus.TURNING if self is PairStatus.OK and not step.appended else self


_OF_WORTH = {
    Worth.MEASURED: PairStatus.OK, Worth.STILL: PairStatus.STILL,
    Worth.NOTHING: PairStatus.NO_MEASUREMENT}


def is_gap(interval: float, max_gap: float) -> bool:
    """Return whether ``interval`` exceeds ``max_gap``, both in seconds; 0 means no limit."""
    return 0.0 < max_gap < interval


def status_of(*, gap: bool, worth: Worth | None, bridged: bool) -> PairStatus:
    """
    Return the status of a pair before it is coded.

    Parameters
    ----------
    gap
        Whether the interval between the two frames exceeds the limit.
    worth
        What the pair is worth; None if its frames cannot be compared.
    bridged
        Whether the pair is coded by its yaw, and the yaw was not measured or was rejected.

    """
    if gap:
        return PairStatus.GAP
    if worth is None:
        return PairStatus.REPRIMED
    if bridged and worth is Worth.MEASURED:
        return PairStatus.NO_MEASUREMENT
    return _OF_WORTH[worth]
