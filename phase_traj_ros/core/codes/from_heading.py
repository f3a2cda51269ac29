# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The chain code from the heading: it has turned when it has turned.

The direction is the heading, quantised with hysteresis. So a turn of 180 degrees changes it twice,
a bend of 90 degrees once however gently it is driven, and a swerve to one side and back not at
all. The same two series of codes as the paper's (see ``chain_code``), from a better reason.
"""

import math

from phase_traj_ros.core.codes.chain import ChainCode, Step
from phase_traj_ros.core.codes.codes import Direction, Movement
from phase_traj_ros.core.codes.freeman import AnyDirection, Freeman, to_four

CONNECTIVITIES = (4, 8)
# How far, in sectors, the heading has to be past the border of two sectors to leave the one it is
# in: 6 degrees of 90. A field of view that is 10 % too narrow makes three right angles to the same
# side 36 degrees too small; they are still three as long as that and the hysteresis are below 45.
_HYSTERESIS = 6.0 / 90.0
# Above this the vehicle yaws, radians per second.
_YAWING = math.radians(5.0)


class HeadingCode(ChainCode):
    """
    Turns the heading after each pair of frames into a movement code and a direction code.

    The movement is ``LEFT`` or ``RIGHT`` for a pair on which the direction changes, ``NO_CHANGE``
    while the vehicle yaws without that, and ``FORWARD`` otherwise. The direction changes by one
    sector per pair at most; where the heading is more than one ahead, the next pairs follow. So
    for n frames there are n - 1 movements, and as many directions as movements other than
    ``NO_CHANGE``, and consecutive directions are neighbours.
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
            Runs that each series keeps; None keeps all.

        Raises
        ------
        ValueError
            The connectivity is neither 4 nor 8, or ``max_runs`` is below 1.

        """
        if connectivity not in CONNECTIVITIES:
            raise ValueError(f'connectivity is {connectivity}: give 4 or 8')
        self._connectivity = connectivity
        self._sector = 2.0 * math.pi / connectivity
        self._border = self._sector * (0.5 + _HYSTERESIS)
        super().__init__(max_runs=max_runs)
        self.reset()

    @property
    def connectivity(self) -> int:
        """Return how many directions there are, 4 or 8."""
        return self._connectivity

    @property
    def directions(self) -> type[Direction] | type[Freeman]:
        """Return which directions there are: the paper's four, or Freeman's eight."""
        return Freeman if self._connectivity == 8 else Direction

    @property
    def heading(self) -> AnyDirection:
        """Return the current direction."""
        code = Freeman((Freeman.FORWARD + self._sectors * (8 // self._connectivity)) % 8)
        return code if self._connectivity == 8 else to_four(code)

    def reset(self) -> None:
        """Start anew: no codes, direction ``FORWARD``, the next pair is the first."""
        super().reset()
        self._sectors = 0

    def update(self, heading: float, rate: float) -> Step:
        """
        Judge the next pair of frames.

        Parameters
        ----------
        heading
            After the pair, in radians since the first frame, left positive, not wrapped.
        rate
            Yaw rate in the pair, in radians per second.

        Raises
        ------
        ValueError
            One of them is NaN or infinite; nothing has changed.

        """
        if not (math.isfinite(heading) and math.isfinite(rate)):
            raise ValueError(
                f'heading is {heading} and yaw rate {rate}: give finite numbers, or skip the pair')
        self._turn = None
        if abs(rate) > _YAWING:
            self._turn = Movement.LEFT if rate > 0 else Movement.RIGHT
        return self._append(self._judge(heading))

    def _judge(self, heading: float) -> Movement:
        if not self._started:
            self._started = True
            return Movement.FORWARD
        off = heading - self._sectors * self._sector
        if off > self._border:
            self._sectors += 1
            return Movement.LEFT
        if off < -self._border:
            self._sectors -= 1
            return Movement.RIGHT
        return Movement.FORWARD if self._turn is None else Movement.NO_CHANGE
