# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Converts the measurements of a pair to codes, by the rule that the settings select."""

from phase_traj_ros.core.codes.chain import Step
from phase_traj_ros.core.codes.from_heading import HeadingCode
from phase_traj_ros.core.codes.from_shift import DynamicChainCode
from phase_traj_ros.core.codes.from_turns import TurnCode
from phase_traj_ros.core.codes.threshold_hint import ShiftSummary
from phase_traj_ros.core.heading.visual_compass import HeadingUpdate
from phase_traj_ros.core.settings import CodeSource, EstimatorSettings
from phase_traj_ros.core.status import PairStatus


class Coder:
    """Codes measured pairs by the shift, the heading or the turns, and skips the others."""

    def __init__(self, settings: EstimatorSettings) -> None:
        """Make a coder without codes; the code source does not change later."""
        self.codes: DynamicChainCode | HeadingCode | TurnCode
        """Both codes so far."""
        if settings.code_source is CodeSource.AUTO:
            self.codes = TurnCode(max_runs=settings.max_runs)
        elif settings.code_source is CodeSource.HEADING:
            self.codes = HeadingCode(
                connectivity=settings.connectivity, max_runs=settings.max_runs)
        else:
            self.codes = DynamicChainCode(max_runs=settings.max_runs)
        self.shifts = ShiftSummary()
        """Summary of the shifts, which tells whether the threshold fits."""
        self.reconfigure(settings)

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Apply other settings; the codes so far are kept."""
        self._nominal_period = settings.nominal_period
        if isinstance(self.codes, DynamicChainCode):
            self.codes.configure(
                settings.threshold, confirm_frames=settings.confirm_frames,
                release_frames=settings.release_frames)

    def code(
        self, status: PairStatus, dx: float | None, heading: HeadingUpdate | None, interval: float,
    ) -> Step:
        """
        Code a pair of status OK, or skip another one, whose quarters are coded later.

        ``dx`` is the shift in pixels of the full frame, positive to the right, None if it was not
        measured; ``heading`` what the pair adds to the heading, None if nothing; ``interval`` the
        seconds between the two frames.
        """
        codes = self.codes
        if status is not PairStatus.OK:
            if status is not PairStatus.REPEATED:
                self.shifts.miss()
            if isinstance(codes, TurnCode) and heading is not None:
                codes.expect(heading.quarters)
            return codes.skip(end_turn=status.ends_turn)
        if isinstance(codes, DynamicChainCode):
            assert dx is not None
            if self._nominal_period > 0:
                # After a dropped frame, the shift is that of two periods.
                dx *= self._nominal_period / interval
                interval = self._nominal_period
            self.shifts.add(dx, codes.threshold, interval=interval)
            return codes.update(dx)
        assert heading is not None
        if isinstance(codes, HeadingCode):
            return codes.update(heading.step.heading, heading.step.rate)
        return codes.update(heading.quarters, heading.step.rate)
