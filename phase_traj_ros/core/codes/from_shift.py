# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The chain code from the shifts: the paper's state machine.

docs/explanation/method.md explains how the paper's text and inequalities are interpreted.
"""

import math

from phase_traj_ros.core.codes.chain import ChainCode, Step
from phase_traj_ros.core.codes.codes import Movement

PAPER_THRESHOLD = 16.0


class DynamicChainCode(ChainCode):
    """
    Turns the x-shift of each pair of frames into a movement code and a direction code.

    A shift of ``threshold`` or more begins a turn. The pair on which it begins has one code, and
    the next pairs are ``NO_CHANGE`` until one falls below the threshold.

    Wrong shifts can be bridged. A turn begins on the ``confirm_frames``-th consecutive pair at or
    beyond the threshold on one side. The pairs before it are ``NO_CHANGE``, and stay so if the
    turn is not confirmed. A turn ends on the ``release_frames``-th consecutive pair that is not
    beyond the threshold on its side. The pairs before it belong to the turn, and that pair is
    judged afresh. Codes never change later. With 1 and 1, the defaults, this is the paper's state
    machine.
    """

    def __init__(
        self, threshold: float = PAPER_THRESHOLD, *, confirm_frames: int = 1,
        release_frames: int = 1, max_runs: int | None = None,
    ) -> None:
        """
        Make a chain code that starts with the direction ``FORWARD``.

        Parameters
        ----------
        threshold
            T in pixels per frame, finite and above 0 (the paper: 12 to 60).
        confirm_frames
            Consecutive pairs beyond the threshold that begin a turn; 3 ignores swerves of up to 2.
        release_frames
            Consecutive pairs that end a turn; 4 bridges up to 3 wrong ones.
        max_runs
            Runs that each of the two series keeps; None keeps all of them.

        Raises
        ------
        ValueError
            The threshold is not a finite number above 0, or one of the other values is below 1.

        """
        super().__init__(max_runs=max_runs)
        self.configure(threshold, confirm_frames=confirm_frames, release_frames=release_frames)

    def configure(
        self, threshold: float, *, confirm_frames: int = 1, release_frames: int = 1,
    ) -> None:
        """
        Judge by other values from the next pair on; the parameters are those of the constructor.

        Raises
        ------
        ValueError
            The threshold is not a finite number above 0, or one of the other values is below 1.

        """
        if not (math.isfinite(threshold) and threshold > 0):
            raise ValueError(f'threshold is {threshold}: give a finite number of pixels above 0')
        for name, value in (
                ('confirm_frames', confirm_frames), ('release_frames', release_frames)):
            if value < 1:
                raise ValueError(f'{name} is {value}: give at least 1')
        self.threshold = float(threshold)
        """T in pixels per frame."""
        self._confirm_frames, self._release_frames = confirm_frames, release_frames

    def update(self, dx: float) -> Step:
        """
        Judge the next pair of frames by its x-shift in pixels, positive to the right.

        Raises
        ------
        ValueError
            ``dx`` is NaN or infinite. The state is unchanged. Use ``skip`` for a pair without a
            measurement.

        """
        if not math.isfinite(dx):
            raise ValueError(f'shift is {dx}: give a finite number, or skip the pair')
        return self._append(self._judge(dx))

    def _end_turn(self) -> None:
        super()._end_turn()
        # Consecutive pairs that were not beyond the threshold on the side of the current turn.
        self._off_turn = 0
        # Side on which the newest pair was beyond the threshold, and for how many pairs in a row.
        self._side: Movement | None = None
        self._on_side = 0

    def _judge(self, dx: float) -> Movement:
        if not self.direction:
            return Movement.FORWARD
        side = self._side_of(dx)
        self._on_side = self._on_side + 1 if side is self._side else 1
        self._side = side
        if self.turn is not None and not self._is_released(side):
            return Movement.NO_CHANGE
        self.turn = None
        if side is None:
            return Movement.FORWARD
        if self._on_side < self._confirm_frames:
            return Movement.NO_CHANGE
        self.turn = side
        self._off_turn = 0
        return self._turned(side)

    def _side_of(self, dx: float) -> Movement | None:
        if dx >= self.threshold:
            return Movement.LEFT
        return Movement.RIGHT if dx <= -self.threshold else None

    def _is_released(self, side: Movement | None) -> bool:
        """Count a pair during a turn; return whether the turn ends with it."""
        self._off_turn = 0 if side is self.turn else self._off_turn + 1
        return self._off_turn >= self._release_frames
