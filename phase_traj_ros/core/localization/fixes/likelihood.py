# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The likelihood of a position fix on a road and off the road."""

import math

import numpy as np
from phase_traj_ros.core.localization.given import PositionFix
from phase_traj_ros.core.localization.roads import Complexes, Floats
from phase_traj_ros.core.localization.settings import LocatorSettings


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
