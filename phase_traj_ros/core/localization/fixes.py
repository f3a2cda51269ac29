# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Position fixes: which of them to believe, and what they weigh."""

from enum import Enum
import math

import numpy as np
from phase_traj_ros.core.localization.given import PositionFix
from phase_traj_ros.core.localization.roads import Complexes, Floats
from phase_traj_ros.core.localization.settings import LocatorSettings


class Verdict(Enum):
    """What becomes of a fix."""

    IGNORED = 'ignored'
    """It contradicts what is known, or comes too soon after the last one."""
    USED = 'used'
    """It weighs the hypotheses."""
    TRUSTED = 'trusted'
    """The vehicle is there, whatever was believed before."""


class FixGate:
    """
    Judges fixes by the place that leads, or else by the last fix and the way since.

    Successive fixes that are doubted but agree with each other are right in the end.
    """

    def __init__(self, settings: LocatorSettings) -> None:
        """Know nothing."""
        self._settings = settings
        self.forget()

    def forget(self) -> None:
        """Know nothing again: the odometry was interrupted."""
        self._last: tuple[PositionFix, float] | None = None
        self._doubted: tuple[PositionFix, float] | None = None
        self._doubts = 0

    def judge(
        self, fix: PositionFix, way: float, expected: complex | None, covariance: Floats,
    ) -> Verdict:
        """
        Judge a fix.

        Parameters
        ----------
        fix
            The fix.
        way
            Metres travelled so far.
        expected
            The place that leads as a complex number in metres; None if none does.
        covariance
            Its covariance, (2, 2).

        """
        settings = self._settings
        if expected is not None:
            off = np.array([fix.x - expected.real, fix.y - expected.imag])
            total = covariance + covariance_of(fix, settings.fix_road_m)
            fits = float(off @ np.linalg.solve(total, off)) <= settings.fix_gate ** 2
        else:
            fits = self._last is None or self._agree(*self._last, fix, way)
        if not fits:
            agrees = self._doubted is not None and self._agree(*self._doubted, fix, way)
            self._doubts = self._doubts + 1 if agrees else 1
            self._doubted = fix, way
            if self._doubts < settings.fixes_to_convince:
                return Verdict.IGNORED
        first = self._last is None and expected is None
        if fits and self._last is not None and (
                way - self._last[1] < settings.fix_spacing_m):
            return Verdict.IGNORED
        self._last, self._doubted, self._doubts = (fix, way), None, 0
        return Verdict.TRUSTED if first or not fits else Verdict.USED

    def _agree(self, before: PositionFix, then: float, fix: PositionFix, way: float) -> bool:
        """Return whether the vehicle can have come from one fix to another."""
        spread = math.hypot(radius_of(before), radius_of(fix))
        apart = math.hypot(fix.x - before.x, fix.y - before.y)
        return apart <= (way - then) * 1.2 + self._settings.fix_gate * spread


def covariance_of(fix: PositionFix, road: float) -> Floats:
    """Return the covariance of a fix against the line of a road, (2, 2)."""
    return np.array([
        [fix.variance_x + road ** 2, fix.covariance_xy],
        [fix.covariance_xy, fix.variance_y + road ** 2]])


def radius_of(fix: PositionFix) -> float:
    """Return the largest standard deviation of a fix in metres."""
    mean, half = (fix.variance_x + fix.variance_y) / 2, (fix.variance_x - fix.variance_y) / 2
    return math.sqrt(mean + math.hypot(half, fix.covariance_xy))


def log_likelihood(
    fix: PositionFix, places: Complexes, area: float, settings: LocatorSettings,
) -> Floats:
    """Return the logarithm of the likelihood of places by a fix; outliers are all over an area."""
    covariance = covariance_of(fix, settings.fix_road_m)
    off = np.stack([places.real - fix.x, places.imag - fix.y])
    squared = (off * np.linalg.solve(covariance, off)).sum(axis=0)
    return _log_mixture(covariance, np.exp(-squared / 2), area, settings)


def log_likelihood_off_road(fix: PositionFix, area: float, settings: LocatorSettings) -> float:
    """
    Return the logarithm of the likelihood of being on no road by a fix.

    Such a vehicle is near the fix, but not at it: it fits as one on a road does on average, that
    is 1 nat below the peak. Only the fixes before tell where it is, and they err as much as this
    one. So the variances are doubled, and the peak is half.
    """
    fit = np.array([math.exp(-1.0) / 2])
    return float(_log_mixture(covariance_of(fix, settings.fix_road_m), fit, area, settings)[0])


def _log_mixture(
    covariance: Floats, fit: Floats, area: float, settings: LocatorSettings,
) -> Floats:
    """Return the logarithm of likelihoods that are relative to the peak, with the outliers."""
    peak = 1.0 / (2 * math.pi * math.sqrt(float(np.linalg.det(covariance))))
    likelihood: Floats = np.log(
        (1.0 - settings.fix_outliers) * peak * fit + settings.fix_outliers / area)
    return likelihood
