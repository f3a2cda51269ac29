# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The base of all chain codes: the two series of codes, and how they grow."""

from dataclasses import dataclass
from typing import Any

from phase_traj_ros.core.codes.codes import Direction, Movement
from phase_traj_ros.core.codes.freeman import AnyDirection, Freeman
from phase_traj_ros.core.codes.series import CodeSeries
from phase_traj_ros.core.codes.tuning import TUNING


def yawing(rate: float) -> Movement | None:
    """Return the side to which a vehicle yaws at ``rate``, in rad/s; None if it does not yaw."""
    if abs(rate) <= TUNING.min_yaw_rate:
        return None
    return Movement.LEFT if rate > 0 else Movement.RIGHT


@dataclass(frozen=True, slots=True)
class Step:
    """What one pair of frames adds to the chain code."""

    movement: Movement
    direction: AnyDirection
    """The direction after this pair, whether it was appended or not."""

    @property
    def appended(self) -> bool:
        """Return whether the direction was appended to the direction code."""
        return self.movement is not Movement.NO_CHANGE


class ChainCode:
    """
    Two series of codes: one movement for each pair of frames, and the directions.

    A direction is appended for each movement other than ``NO_CHANGE``. So n frames give n - 1
    movements, and as many directions as movements other than ``NO_CHANGE``.
    """

    directions: type[Direction] | type[Freeman] = Direction
    """Type of the directions: the paper's four, or Freeman's eight."""

    def __init__(self, *, max_runs: int | None = None) -> None:
        """Make a chain code that starts with ``FORWARD``; each series keeps ``max_runs`` runs."""
        self.movement: CodeSeries[Movement] = CodeSeries(max_runs=max_runs)
        """The movement codes so far, one per pair of frames."""
        self.direction: CodeSeries[Any] = CodeSeries(max_runs=max_runs)
        """The direction codes so far, one per movement that is not ``NO_CHANGE``."""
        self.turn: Movement | None = None
        """The current turn, ``LEFT`` or ``RIGHT``, or None."""
        self.heading: AnyDirection = self.directions.FORWARD
        """The current direction."""
        self._end_turn()

    def skip(self, *, end_turn: bool = False) -> Step:
        """
        Append ``NO_CHANGE`` for a pair that cannot be judged.

        The pair neither continues nor ends a turn. With ``end_turn`` the next pairs are unrelated
        to the earlier ones, so the current turn ends.
        """
        if end_turn:
            self._end_turn()
        return self._append(Movement.NO_CHANGE)

    def _end_turn(self) -> None:
        self.turn = None

    def _turned(self, side: Movement) -> Movement:
        """Turn the direction by a quarter to a side; return the side."""
        heading = Direction(self.heading)
        self.heading = (heading.turned_left() if side is Movement.LEFT else heading.turned_right())
        return side

    def _append(self, movement: Movement) -> Step:
        step = Step(movement, self.heading)
        self.movement.append(movement)
        if step.appended:
            self.direction.append(self.heading)
        return step
