# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Changes of scene in an edited film, told by how well the blocks of each pair agree.

Across a cut the two frames have nothing in common, so hardly any block agrees with any motion,
nor does the picture as a whole, while the pairs on both sides of it are as good as ever. That
tells a cut from all else that spoils pairs: what passes in front of the camera, or covers it,
spoils several in a row; a change of exposure spoils none; and where frames were lost, the stamps
show it.
"""

from phase_traj_ros.core.heading.yaw_meter import YawMeasurement

# Share of the blocks that agree: in the pairs next to a cut at least the first, and across it less
# than the second times that. Of unrelated frames 0.04 agree, at most 0.11.
_GOOD, _CUT = 0.3, 0.25
# Frames that are this many times as far apart as those before had others between them.
_LOST = 1.5


class CutDetector:
    """
    Tells that the scene has changed, one pair after it has.

    Only the pair after a cut tells it from a covered lens. Until then the pair across the cut is
    one without a measurement.
    """

    def __init__(self) -> None:
        """Make one that has seen no pair."""
        self.reset()

    def reset(self) -> None:
        """Forget the pairs so far, as after a gap."""
        self._before = 0.0
        self._doubted: float | None = None
        self._interval = 0.0

    def update(self, measured: YawMeasurement | None, interval: float) -> bool:
        """
        Take the next pair; return whether the scene changed in the pair before it.

        Parameters
        ----------
        measured
            What it tells of the camera's rotation; None where the frames were not compared, which
            is not a cut.
        interval
            Between the two frames, in seconds.

        """
        if measured is None:
            self.reset()
            return False
        agreement = measured.agreement
        cut = (self._doubted is not None and agreement >= _GOOD
               and self._doubted < _CUT * agreement)
        lost = 0.0 < self._interval * _LOST < interval
        doubted = (measured.yaw is None and not lost
                   and self._before >= _GOOD and agreement < _CUT * self._before)
        self._doubted = agreement if doubted else None
        self._before, self._interval = agreement, interval
        return cut
