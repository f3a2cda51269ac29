# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Decides which position fixes to use."""

from enum import Enum
import math

import numpy as np
from phase_traj_ros.core.localization.fixes.likelihood import covariance_of, radius_of
from phase_traj_ros.core.localization.given import PositionFix
from phase_traj_ros.core.localization.roads import Floats
from phase_traj_ros.core.localization.settings import LocatorSettings


class GateDecision(Enum):
    """What to do with a fix."""

    REJECT = 'reject'
    """Ignore it: it contradicts the estimate, or follows the last fix too closely."""
    WEIGH = 'weigh'
    """Weigh the hypotheses by it."""
    RESTART = 'restart'
    """Restart the filter there: the fix overrides the estimate."""


class FixGate:
    """
    Compares each fix with the leading place or, without one, with the last fix that was used.

    A fix that contradicts it is kept. If enough successive fixes do so, and each agrees with the
    one before, they override the estimate.
    """

    def __init__(self, settings: LocatorSettings) -> None:
        """Make a gate that has seen no fix."""
        self._settings = settings
        self.reset()

    def reset(self) -> None:
        """Forget all fixes: the odometry was interrupted."""
        self._last: tuple[PositionFix, float] | None = None
        self._doubted: tuple[PositionFix, float] | None = None
        self._doubts = 0

    def judge(
        self, fix: PositionFix, travelled: float, expected: complex | None, covariance: Floats,
    ) -> GateDecision:
        """
        Decide what to do with a fix.

        Parameters
        ----------
        fix
            The fix.
        travelled
            Metres travelled up to the stamp of the fix.
        expected
            Position of the leading place at that stamp, x + iy in metres; None if no place leads.
        covariance
            Covariance of ``expected``, (2, 2), in square metres.

        """
        settings = self._settings
        if expected is not None:
            off = np.array([fix.x - expected.real, fix.y - expected.imag])
            total = covariance + covariance_of(fix, settings.fix_road_m)
            fits = float(off @ np.linalg.solve(total, off)) <= settings.fix_gate ** 2
        else:
            fits = self._last is None or self._agree(*self._last, fix, travelled)
        if not fits:
            agrees = self._doubted is not None and self._agree(*self._doubted, fix, travelled)
            self._doubts = self._doubts + 1 if agrees else 1
            self._doubted = fix, travelled
            if self._doubts < settings.fixes_to_convince:
                return GateDecision.REJECT
        first = self._last is None and expected is None
        if fits and self._last is not None and (
                travelled - self._last[1] < settings.fix_spacing_m):
            return GateDecision.REJECT
        self._last, self._doubted, self._doubts = (fix, travelled), None, 0
        return GateDecision.RESTART if first or not fits else GateDecision.WEIGH

    def _agree(
        self, before: PositionFix, travelled_before: float, fix: PositionFix, travelled: float,
    ) -> bool:
        """Return whether the vehicle can have travelled from one fix to another."""
        spread = math.hypot(radius_of(before), radius_of(fix))
        apart = math.hypot(fix.x - before.x, fix.y - before.y)
        return apart <= (travelled - travelled_before) * 1.2 + self._settings.fix_gate * spread
