# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Detects cuts in edited videos from the agreement of the blocks of each pair.

The two frames across a cut are unrelated, so hardly any block agrees with a motion, and the image
as a whole has no shift. The pairs before and after the cut are measured as usual. Other
disturbances differ: an object in front of the camera, or a covered lens, affects several
consecutive pairs; a change of exposure affects none; lost frames show in the stamps.
"""

from phase_traj_ros.core.heading.tuning import TUNING
from phase_traj_ros.core.rotation.tuning import TUNING as YAW
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement


class CutDetector:
    """
    Detects a change of scene, one pair late.

    Only the pair after a cut distinguishes it from a covered lens.
    """

    def __init__(self) -> None:
        """Make a detector before its first pair."""
        self.reset()

    def reset(self) -> None:
        """Forget the pairs so far, as after a gap."""
        self._before = 0.0
        self._doubted: float | None = None
        self._interval = 0.0

    def update(self, measured: YawMeasurement | None, interval: float) -> bool:
        """
        Add the next pair; return whether there was a cut in the previous pair.

        ``measured`` is None if the frames were not compared, which is not a cut; ``interval`` is
        the time between them in seconds.
        """
        if measured is None:
            self.reset()
            return False
        agreement = measured.agreement
        # In a dark image, a few blocks of noise may agree.
        shown = 0.0 if measured.yaw is None else agreement
        cut = (self._doubted is not None and shown >= YAW.min_agreement
               and self._doubted < TUNING.cut_share * shown)
        lost = 0.0 < self._interval * TUNING.lost_intervals < interval
        doubted = (measured.yaw is None and not lost and self._before >= YAW.min_agreement
                   and agreement < TUNING.cut_share * self._before)
        self._doubted = agreement if doubted else None
        self._before, self._interval = shown, interval
        return cut
