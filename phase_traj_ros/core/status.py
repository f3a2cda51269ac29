# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The status of a pair of frames: the one place that decides it."""

from enum import Enum

from phase_traj_ros.core.codes.chain import Step
from phase_traj_ros.core.correlation.quality import Worth


class PairStatus(Enum):
    """How a pair of frames came to its movement code."""

    OK = 'ok'
    """Measured and judged: forward, or the pair on which a turn begins."""
    TURNING = 'turning'
    """Measured; the turn that began earlier goes on."""
    STILL = 'still'
    """The vehicle stands: nothing but noise and passers-by moves in the picture."""
    NO_MEASUREMENT = 'no_measurement'
    """The two frames have nothing in common, or one of them shows nothing."""
    GAP = 'gap'
    """The time between the two frames was longer than allowed."""
    REPRIMED = 'reprimed'
    """The frame's size or encoding changed, or a setting: there is none to compare it with."""

    @property
    def judged(self) -> bool:
        """Return whether the pair was measured and judged, so that a path goes on with it."""
        return self in (PairStatus.OK, PairStatus.TURNING)

    @property
    def ends_turn(self) -> bool:
        """Return whether the pair breaks with all that came before, a turn under way included."""
        return self in (PairStatus.GAP, PairStatus.REPRIMED)

    def coded(self, step: Step) -> 'PairStatus':
        """Return the status after the pair has been coded."""
        return PairStatus.TURNING if self is PairStatus.OK and not step.appended else self


_OF_WORTH = {
    Worth.MEASURED: PairStatus.OK, Worth.STILL: PairStatus.STILL,
    Worth.NOTHING: PairStatus.NO_MEASUREMENT}


def is_gap(interval: float, max_gap: float) -> bool:
    """Return whether two frames are too far apart in time, in seconds; a limit of 0 is none."""
    return 0.0 < max_gap < interval


def status_of(*, gap: bool, worth: Worth | None, bridged: bool) -> PairStatus:
    """
    Return the status of a pair before it is coded.

    Parameters
    ----------
    gap
        Whether the two frames are too far apart in time.
    worth
        What the frames tell; None if they cannot be compared.
    bridged
        Whether the pair is coded by its yaw, and that was not measured or not believed.

    """
    if gap:
        return PairStatus.GAP
    if worth is None:
        return PairStatus.REPRIMED
    if bridged and worth is Worth.MEASURED:
        return PairStatus.NO_MEASUREMENT
    return _OF_WORTH[worth]
