# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Converts the measurements of a pair to codes, by the rule that the settings select."""

from phase_traj_ros.core.codes.chain import ChainCode, Step
from phase_traj_ros.core.codes.from_heading import HeadingCode
from phase_traj_ros.core.codes.from_shift import DynamicChainCode
from phase_traj_ros.core.codes.from_turns import TurnCode
from phase_traj_ros.core.heading.estimator import HeadingUpdate
from phase_traj_ros.core.settings import CodeSource, EstimatorSettings


class Coder:
    """Codes measured pairs by the shift, the heading or the turns, and skips the others."""

    def __init__(self, settings: EstimatorSettings) -> None:
        """Make a coder without codes; the code source does not change later."""
        self._codes: DynamicChainCode | HeadingCode | TurnCode
        if settings.code_source is CodeSource.AUTO:
            self._codes = TurnCode(max_runs=settings.max_runs)
        elif settings.code_source is CodeSource.HEADING:
            self._codes = HeadingCode(
                connectivity=settings.connectivity, max_runs=settings.max_runs)
        else:
            self._codes = DynamicChainCode(max_runs=settings.max_runs)
        self.reconfigure(settings)

    @property
    def codes(self) -> ChainCode:
        """Return both codes so far."""
        return self._codes

    @property
    def threshold_px(self) -> float | None:
        """Return T in pixels per frame; None if the rule does not use one."""
        return self._codes.threshold if isinstance(self._codes, DynamicChainCode) else None

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Apply other settings; the codes so far are kept."""
        self._nominal_period = settings.nominal_period
        if isinstance(self._codes, DynamicChainCode):
            self._codes.threshold = settings.threshold
            self._codes.confirm_frames = settings.confirm_frames
            self._codes.release_frames = settings.release_frames

    def code(self, dx: float, heading: HeadingUpdate | None, interval: float) -> Step:
        """
        Code a measured pair.

        Parameters
        ----------
        dx
            Shift in pixels of the full frame, positive to the right.
        heading
            What the pair adds to the heading; None if the heading is not measured.
        interval
            Seconds between the two frames.

        """
        if isinstance(self._codes, DynamicChainCode):
            if self._nominal_period > 0:
                # After a dropped frame, the shift is that of two periods.
                dx *= self._nominal_period / interval
            return self._codes.update(dx)
        assert heading is not None
        if isinstance(self._codes, TurnCode):
            return self._codes.update(heading.quarters, heading.step.rate)
        return self._codes.update(heading.step.heading, heading.step.rate)

    def skip(self, heading: HeadingUpdate | None, *, end_turn: bool) -> Step:
        """Skip a pair that cannot be judged; a quarter that it completes is coded later."""
        if isinstance(self._codes, TurnCode):
            assert heading is not None
            self._codes.expect(heading.quarters)
        return self._codes.skip(end_turn=end_turn)
