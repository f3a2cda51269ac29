# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The dynamic chain code: from shifts to movements and directions.

The paper's state machine; docs/method.md says how its words and its inequalities are read.
"""

from dataclasses import dataclass
import math

from phase_traj_ros.core.code_series import CodeSeries
from phase_traj_ros.core.codes import Direction, Movement

PAPER_THRESHOLD = 16.0


@dataclass(frozen=True, slots=True)
class Step:
    """What one pair of frames adds to the chain code."""

    movement: Movement
    direction: Direction
    """The direction after this pair, whether it was appended or not."""

    @property
    def appended(self) -> bool:
        """Return whether the direction was appended to the direction code."""
        return self.movement is not Movement.NO_CHANGE


class DynamicChainCode:
    """
    Turns the x-shift of each pair of frames into a movement code and a direction code.

    A shift of ``threshold`` or more begins a turn: one code on the pair where it begins, and
    ``NO_CHANGE`` until a pair falls below the threshold again. So for n frames there are n - 1
    movements, and as many directions as movements other than ``NO_CHANGE``.
    """

    def __init__(
        self, threshold: float = PAPER_THRESHOLD, *, max_runs: int | None = None,
    ) -> None:
        """
        Make a chain code that starts with the direction ``FORWARD``.

        Parameters
        ----------
        threshold
            T in pixels per frame, finite and above 0 (the paper: 12 to 60).
        max_runs
            Runs that each of the two series keeps; None keeps all.

        Raises
        ------
        ValueError
            The threshold is not a finite positive number, or ``max_runs`` is below 1.

        """
        self.threshold = threshold
        self._movement: CodeSeries[Movement] = CodeSeries(max_runs=max_runs)
        self._direction: CodeSeries[Direction] = CodeSeries(max_runs=max_runs)
        self.reset()

    @property
    def threshold(self) -> float:
        """Return T in pixels per frame; a new value holds from the next pair on."""
        return self._threshold

    @threshold.setter
    def threshold(self, value: float) -> None:
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f'threshold is {value}: give a finite number of pixels above 0')
        self._threshold = float(value)

    @property
    def movement(self) -> CodeSeries[Movement]:
        """Return the movement codes so far, one per pair of frames."""
        return self._movement

    @property
    def direction(self) -> CodeSeries[Direction]:
        """Return the direction codes so far, one per pair that is not ``NO_CHANGE``."""
        return self._direction

    @property
    def heading(self) -> Direction:
        """Return the current direction."""
        return self._heading

    @property
    def turn(self) -> Movement | None:
        """Return the turn under way, ``LEFT`` or ``RIGHT``, or None."""
        return self._turn

    def reset(self) -> None:
        """Start anew: no codes, direction ``FORWARD``, the next pair is the first."""
        self._movement.clear()
        self._direction.clear()
        self._heading = Direction.FORWARD
        self._turn: Movement | None = None
        self._started = False

    def update(self, dx: float) -> Step:
        """
        Judge the next pair of frames by its x-shift in pixels, positive to the right.

        Raises
        ------
        ValueError
            ``dx`` is NaN or infinite; nothing has changed (a pair without a measurement is for
            ``skip``).

        """
        if not math.isfinite(dx):
            raise ValueError(f'shift is {dx}: give a finite number, or skip the pair')
        return self._append(self._judge(dx))

    def skip(self, *, end_turn: bool = False) -> Step:
        """
        Append ``NO_CHANGE`` for a pair that cannot be judged.

        A turn under way stays under way, unless ``end_turn`` says that what comes next has
        nothing to do with what came before.
        """
        if end_turn:
            self._turn = None
        return self._append(Movement.NO_CHANGE)

    def _judge(self, dx: float) -> Movement:
        if not self._started:
            self._started = True
            return Movement.FORWARD
        if self._turn is Movement.LEFT and dx >= self._threshold:
            return Movement.NO_CHANGE
        if self._turn is Movement.RIGHT and dx <= -self._threshold:
            return Movement.NO_CHANGE
        self._turn = None
        if dx >= self._threshold:
            self._turn = Movement.LEFT
            self._heading = self._heading.turned_left()
            return Movement.LEFT
        if dx <= -self._threshold:
            self._turn = Movement.RIGHT
            self._heading = self._heading.turned_right()
            return Movement.RIGHT
        return Movement.FORWARD

    def _append(self, movement: Movement) -> Step:
        step = Step(movement, self._heading)
        self._movement.append(movement)
        if step.appended:
            self._direction.append(self._heading)
        return step
