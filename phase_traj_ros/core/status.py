# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The status of a pair of frames; ``judge`` decides it."""

from enum import Enum

from phase_traj_ros.core.codes.chain import Step


class PairStatus(Enum):
    """The reason for the movement code of a pair."""

    OK = 'ok'
    """Measured or foreseen, and judged: forward, or the pair on which a turn is coded."""
    TURNING = 'turning'
    """Measured or foreseen: the vehicle yaws, or a turn continues."""
    STILL = 'still'
    """The vehicle stands: the road does not move, or only noise and traffic move in the image."""
    NO_MEASUREMENT = 'no_measurement'
    """The two frames are unrelated, one of them has no content, or what they have in common may be
    fixed to the camera."""
    GAP = 'gap'
    """The interval between the two frames exceeds the limit."""
    REPRIMED = 'reprimed'
    """The size or encoding of the frames, the calibration or a setting of the correlation changed,
    so the pair cannot be compared."""
    REPEATED = 'repeated'
    """Both frames show the same image, or are less than 2 ms apart: nothing is measured, the next
    pair covers the time."""

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
