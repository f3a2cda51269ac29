# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The chain code from the turns: a quarter turn is coded when the vehicle has completed it.

A turn counts from 60 degrees on. It changes the direction by its angle in right angles, rounded
(see ``Turn.quarter_turns``). So a corner of 70 degrees and one of 110 are one quarter each, a
U-turn is two, and a bend of less than 60 degrees changes nothing. An angle that is wrong by 20
degrees, e.g. because the field of view is not known well, still gives the right code.
"""

from collections import deque
from collections.abc import Iterable

from phase_traj_ros.core.codes.chain import ChainCode, Step, yawing
from phase_traj_ros.core.codes.codes import Movement


class TurnCode(ChainCode):
    """
    Turns the completed quarter turns into a movement code and a direction code for each pair.

    The movement is ``LEFT`` or ``RIGHT`` for a pair that completes a quarter of a turn,
    ``NO_CHANGE`` for the other pairs of a turn or a bend, and ``FORWARD`` otherwise. The direction
    changes by at most one quarter per pair. If the turn is more than one quarter ahead, the next
    pairs follow it.
    """

    def __init__(self, *, max_runs: int | None = None) -> None:
        """Make a chain code that starts with ``FORWARD``; each series keeps ``max_runs`` runs."""
        super().__init__(max_runs=max_runs)
        self._due: deque[int] = deque()

    def expect(self, quarters: Iterable[int]) -> None:
        """Queue quarter turns for the next pairs, see ``update``."""
        self._due.extend(quarters)

    def update(self, quarters: Iterable[int], rate: float) -> Step:
        """
        Judge the next pair of frames.

        ``quarters`` are the quarter turns completed since the last pair, in order: 1 left, -1
        right; ``rate`` is the yaw rate of the pair in radians per second, positive to the left.
        """
        self.expect(quarters)
        self.turn = yawing(rate)
        return self._append(self._judge())

    def _judge(self) -> Movement:
        if not self.direction:
            return Movement.FORWARD
        if not self._due:
            return Movement.FORWARD if self.turn is None else Movement.NO_CHANGE
        return self._turned(Movement.LEFT if self._due.popleft() > 0 else Movement.RIGHT)
