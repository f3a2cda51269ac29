# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Position fixes: the poses that they refer to, their likelihood, and which of them to use."""

from collections import deque
from enum import Enum
import math

import numpy as np
from phase_traj_ros.core.localization.given import PositionFix
from phase_traj_ros.core.localization.roads import Complexes, Floats
from phase_traj_ros.core.localization.settings import LocatorSettings

# A fix may be this much older than the newest pose of the odometry, or this much newer.
_KEPT_NS, _AHEAD_NS = 5_000_000_000, 1_000_000_000


def check_age(age_ns: int) -> None:
    """
    Check the age of a fix: the stamp of the newest pose of the odometry minus that of the fix.

    Raises
    ------
    ValueError
        The fix is more than 5 s old, or more than 1 s ahead.

    """
    if not -_AHEAD_NS <= age_ns <= _KEPT_NS:
        raise ValueError(
            f'its stamp is {abs(age_ns) * 1e-9:.1f} s {"before" if age_ns > 0 else "after"} that'
            f' of the newest frame: at most {_KEPT_NS * 1e-9:.0f} s before and'
            f' {_AHEAD_NS * 1e-9:.0f} s after are used, on the clock of the images')


class Track:
    """The positions of the odometry in the last 5 s, by stamp."""

    def __init__(self) -> None:
        """Make an empty track."""
        self._past: deque[tuple[int, complex, float]] = deque()

    def add(self, stamp_ns: int, position: complex, travelled: float) -> None:
        """
        Append a position of the odometry, and the metres travelled up to it.

        A stamp before the last one deletes the earlier positions: the clock was set back.
        """
        past = self._past
        if past and stamp_ns < past[-1][0]:
            past.clear()
        if past and stamp_ns == past[-1][0]:
            past.pop()
        past.append((stamp_ns, position, travelled))
        while len(past) > 1 and stamp_ns - past[1][0] >= _KEPT_NS:
            past.popleft()

    def at(self, stamp_ns: int) -> tuple[complex, float]:
        """
        Return the position and the metres travelled at a stamp.

        Interpolates between positions. After the newest one, extrapolates by mirroring the track
        at it.

        Raises
        ------
        ValueError
            The track is empty or begins after the stamp, or the stamp is too old or too new.

        """
        if not self._past:
            raise ValueError('there is no pose yet')
        newest, position, travelled = self._past[-1]
        check_age(newest - stamp_ns)
        if stamp_ns > newest:
            mirrored, travelled_there = self.at(2 * newest - stamp_ns)
            return 2 * position - mirrored, 2 * travelled - travelled_there
        stamps, positions, distances = zip(*self._past)
        if stamp_ns < stamps[0]:
            raise ValueError('its stamp is before the first pose')
        # Stamps have more digits than floats.
        ages = [stamp - newest for stamp in stamps]
        return (complex(np.interp(stamp_ns - newest, ages, positions)),
                float(np.interp(stamp_ns - newest, ages, distances)))


def covariance_of(fix: PositionFix, road: float) -> Floats:
    """
    Return the covariance of a fix relative to the centre line of its road, (2, 2), in m².

    ``road`` is the standard deviation of the vehicle from that line in metres.
    """
    return np.array([
        [fix.variance_x + road ** 2, fix.covariance_xy],
        [fix.covariance_xy, fix.variance_y + road ** 2]])


def radius_of(fix: PositionFix) -> float:
    """Return the largest standard deviation of a fix over all directions, in metres."""
    mean, half = (fix.variance_x + fix.variance_y) / 2, (fix.variance_x - fix.variance_y) / 2
    return math.sqrt(mean + math.hypot(half, fix.covariance_xy))


def log_likelihood(
    fix: PositionFix, positions: Complexes, area: float, settings: LocatorSettings,
) -> Floats:
    """
    Return the log-likelihood of a fix at each of some positions on roads, (N,).

    ``positions`` is x + iy in metres, (N,). Outliers are uniform over ``area``, in m².
    """
    covariance = covariance_of(fix, settings.fix_road_m)
    off = np.stack([positions.real - fix.x, positions.imag - fix.y])
    squared = (off * np.linalg.solve(covariance, off)).sum(axis=0)
    return _log_mixture(covariance, np.exp(-squared / 2), area, settings)


def log_likelihood_off_road(fix: PositionFix, area: float, settings: LocatorSettings) -> float:
    """
    Return the log-likelihood of a fix under the null hypothesis.

    Its position is known only from the earlier fixes, which are as uncertain as this one: this
    doubles the variances, which halves the peak density. The misfit is the average one of a
    vehicle on a road, 1 nat below the peak.
    """
    fit = np.array([math.exp(-1.0) / 2])
    return float(_log_mixture(covariance_of(fix, settings.fix_road_m), fit, area, settings)[0])


def _log_mixture(
    covariance: Floats, fit: Floats, area: float, settings: LocatorSettings,
) -> Floats:
    """Return the log-likelihood with outliers; ``fit`` is the density relative to its peak."""
    peak = 1.0 / (2 * math.pi * math.sqrt(float(np.linalg.det(covariance))))
    likelihood: Floats = np.log(
        (1.0 - settings.fix_outliers) * peak * fit + settings.fix_outliers / area)
    return likelihood


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
        self.reset(anywhere=True, known=False)

    def reset(self, *, anywhere: bool, known: bool) -> None:
        """
        Forget all fixes: the odometry was interrupted.

        The next fix overrides the estimate if the vehicle may be ``anywhere`` after that, or if
        its place has not been ``known``, neither from a fix nor from the map.
        """
        self._anywhere: bool = anywhere or (
            self._anywhere and self._last is None and not known)
        # Each with the metres travelled up to it.
        self._last: tuple[PositionFix, float] | None = None
        # Those in a row that contradict the estimate; each agrees with the one before.
        self._doubted: list[tuple[PositionFix, float]] = []
        # The first of the newest fixes at one position.
        self._repeated: tuple[PositionFix, float] | None = None

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
        settings, last = self._settings, self._last
        if self._is_frozen(fix, travelled):
            return GateDecision.REJECT
        if expected is not None:
            off = np.array([fix.x - expected.real, fix.y - expected.imag])
            total = covariance + covariance_of(fix, settings.fix_road_m)
            fits = float(off @ np.linalg.solve(total, off)) <= settings.fix_gate ** 2
        else:
            fits = last is None or self._agree(*last, fix, travelled)
        if fits:
            if last is not None and travelled - last[1] < settings.fix_spacing_m:
                return GateDecision.REJECT
        else:
            doubted = self._doubted
            if doubted and not self._agree(*doubted[-1], fix, travelled):
                doubted.clear()
            if doubted and travelled - doubted[-1][1] < settings.fix_spacing_m:
                return GateDecision.REJECT
            doubted.append((fix, travelled))
            if len(doubted) < settings.fixes_to_convince:
                return GateDecision.REJECT
        self._last, self._doubted = (fix, travelled), []
        first = self._anywhere and last is None and expected is None
        return GateDecision.RESTART if first or not fits else GateDecision.WEIGH

    def _is_frozen(self, fix: PositionFix, travelled: float) -> bool:
        """Return whether a receiver repeats a position while the vehicle moves, as in tunnels."""
        same = self._repeated
        if same is None or (fix.x, fix.y) != (same[0].x, same[0].y):
            self._repeated = fix, travelled
            return False
        return travelled - same[1] >= self._settings.fix_spacing_m

    def _agree(
        self, before: PositionFix, travelled_before: float, fix: PositionFix, travelled: float,
    ) -> bool:
        """Return whether the vehicle can have travelled from one fix to another."""
        spread = math.hypot(radius_of(before), radius_of(fix))
        apart = math.hypot(fix.x - before.x, fix.y - before.y)
        return apart <= (travelled - travelled_before) * 1.2 + self._settings.fix_gate * spread
