# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The chain code from the heading.

The direction is the heading, quantised with hysteresis. So a turn of 180 degrees changes it
twice, a bend of 90 degrees changes it once however gentle it is, and a swerve to one side and back
does not change it. The two series of codes are those of ``chain``.
"""

import math

from phase_traj_ros.core.codes.chain import ChainCode, Step, yawing
from phase_traj_ros.core.codes.codes import Movement
from phase_traj_ros.core.codes.sectors import HeadingSector


class HeadingCode(ChainCode):
    """
    Turns the heading after each pair of frames into a movement code and a direction code.

    The movement is ``LEFT`` or ``RIGHT`` for a pair on which the direction changes, ``NO_CHANGE``
    for other pairs on which the vehicle yaws, and ``FORWARD`` otherwise. The direction changes by
    at most one sector per pair. If the heading is more than one sector ahead, the next pairs
    follow it, so consecutive directions are neighbours.
    """

    def __init__(self, *, connectivity: int = 4, max_runs: int | None = None) -> None:
        """
        Make a chain code that starts with the direction ``FORWARD``.

        Parameters
        ----------
        connectivity
            4 for sectors of 90 degrees and the paper's codes, 8 for sectors of 45 degrees and
            Freeman's.
        max_runs
            Runs that each series keeps; None keeps all of them.

        Raises
        ------
        ValueError
            The connectivity is neither 4 nor 8, or ``max_runs`` is below 1.

        """
        self._sector = HeadingSector(connectivity)
        self.directions = self._sector.directions
        super().__init__(max_runs=max_runs)

    def update(self, heading: float, rate: float) -> Step:
        """
        Judge the next pair of frames.

        ``heading`` is that after the pair, in radians relative to the first frame, positive to the
        left, not wrapped; ``rate`` the yaw rate of the pair in radians per second.

        Raises
        ------
        ValueError
            An argument is NaN or infinite. The state is unchanged.

        """
        if not (math.isfinite(heading) and math.isfinite(rate)):
            raise ValueError(
                f'heading is {heading} and yaw rate {rate}: give finite numbers, or skip the pair')
        self.turn = yawing(rate)
        return self._append(self._judge(heading))

    def _judge(self, heading: float) -> Movement:
        if not self.direction:
            return Movement.FORWARD
        turned = self._sector.follow(heading)
        self.heading = self._sector.direction
        if turned:
            return Movement.LEFT if turned > 0 else Movement.RIGHT
        return Movement.FORWARD if self.turn is None else Movement.NO_CHANGE
