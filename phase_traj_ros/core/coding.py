# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Converts the measurements of a pair to codes, by the rule that the settings select."""

from typing import Protocol

from phase_traj_ros.core.codes.chain import ChainCode, Step
from phase_traj_ros.core.codes.from_heading import HeadingCode
from phase_traj_ros.core.codes.from_shift import DynamicChainCode
from phase_traj_ros.core.codes.from_turns import TurnCode
from phase_traj_ros.core.heading.estimator import HeadingUpdate
from phase_traj_ros.core.settings import CodeSource, EstimatorSettings


class Coder(Protocol):
    """Codes measured pairs and skips the others."""

    @property
    def codes(self) -> ChainCode:
        """Return both codes so far."""

    @property
    def threshold_px(self) -> float | None:
        """Return T for the newest pair in pixels per frame; None if the rule does not use one."""

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Apply other settings; the codes so far are kept."""

    def reset(self) -> None:
        """Start again without codes."""

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

    def skip(self, heading: HeadingUpdate | None, *, end_turn: bool) -> Step:
        """Skip a pair that cannot be judged, see ``ChainCode.skip``."""


class ShiftCoder:
    """Codes the shift by the threshold, as in the paper."""

    def __init__(self, settings: EstimatorSettings) -> None:
        """Make a coder without codes."""
        self._codes = DynamicChainCode(settings.threshold, max_runs=settings.max_runs)
        self.reconfigure(settings)

    @property
    def codes(self) -> ChainCode:
        """Return both codes so far."""
        return self._codes

    @property
    def threshold_px(self) -> float | None:
        """Return T for the newest pair in pixels per frame."""
        return self._codes.threshold

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Apply other settings; the codes so far are kept."""
        self._settings = settings
        self._codes.threshold = settings.threshold
        self._codes.confirm_frames = settings.confirm_frames
        self._codes.release_frames = settings.release_frames

    def reset(self) -> None:
        """Start again without codes."""
        self._codes.reset()

    def code(self, dx: float, heading: HeadingUpdate | None, interval: float) -> Step:
        """Code a measured pair, see ``Coder``."""
        if self._settings.nominal_period > 0:
            # After a dropped frame, the shift is that of two periods.
            dx *= self._settings.nominal_period / interval
        return self._codes.update(dx)

    def skip(self, heading: HeadingUpdate | None, *, end_turn: bool) -> Step:
        """Skip a pair that cannot be judged, see ``ChainCode.skip``."""
        return self._codes.skip(end_turn=end_turn)


class HeadingCoder:
    """Codes the quantised heading."""

    def __init__(self, settings: EstimatorSettings) -> None:
        """Make a coder without codes."""
        self._codes = HeadingCode(
            connectivity=settings.connectivity, max_runs=settings.max_runs)

    @property
    def threshold_px(self) -> None:
        """Return None: this rule does not use a threshold."""

    @property
    def codes(self) -> ChainCode:
        """Return both codes so far."""
        return self._codes

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Do nothing: no setting that can change affects the heading."""

    def reset(self) -> None:
        """Start again without codes."""
        self._codes.reset()

    def code(self, dx: float, heading: HeadingUpdate | None, interval: float) -> Step:
        """Code a measured pair, see ``Coder``."""
        assert heading is not None
        return self._codes.update(heading.step.heading, heading.step.rate)

    def skip(self, heading: HeadingUpdate | None, *, end_turn: bool) -> Step:
        """Skip a pair that cannot be judged, see ``ChainCode.skip``."""
        return self._codes.skip(end_turn=end_turn)


class TurnCoder:
    """Codes the quarter turns."""

    def __init__(self, settings: EstimatorSettings) -> None:
        """Make a coder without codes."""
        self._codes = TurnCode(max_runs=settings.max_runs)

    @property
    def codes(self) -> ChainCode:
        """Return both codes so far."""
        return self._codes

    @property
    def threshold_px(self) -> None:
        """Return None: this rule does not use a threshold."""

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Do nothing: no setting that can change affects the turns."""

    def reset(self) -> None:
        """Start again without codes."""
        self._codes.reset()

    def code(self, dx: float, heading: HeadingUpdate | None, interval: float) -> Step:
        """Code a measured pair, see ``Coder``."""
        assert heading is not None
        return self._codes.update(heading.quarters, heading.step.rate)

    def skip(self, heading: HeadingUpdate | None, *, end_turn: bool) -> Step:
        """Skip a pair that cannot be judged; a quarter that it completes is coded later."""
        assert heading is not None
        self._codes.expect(heading.quarters)
        return self._codes.skip(end_turn=end_turn)


def make_coder(settings: EstimatorSettings) -> Coder:
    """Return the coder for the code source of the settings."""
    if settings.code_source is CodeSource.AUTO:
        return TurnCoder(settings)
    if settings.code_source is CodeSource.HEADING:
        return HeadingCoder(settings)
    return ShiftCoder(settings)
