# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Learns an unknown camera: its focal length, straightness, principal point and horizon.

The fits update a prior over cameras. It is a grid of focal lengths and straightnesses, so a wrong
fit is outvoted, and the memory is constant.
"""

from collections.abc import Iterator
import math

import numpy as np
from phase_traj_ros.core.calibration.self_calibration import guesses_for, SelfCalibration
from phase_traj_ros.core.calibration.tuning import TUNING
from phase_traj_ros.core.calibration.turn_fit import fit_turn, TurnFit
from phase_traj_ros.core.calibration.turn_tracks import TurnTracks
from phase_traj_ros.core.camera.estimate import CameraEstimate
from phase_traj_ros.core.camera.horizon import HorizonEstimator
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.camera.lens_family import Numbers, PINHOLE, STRAIGHTNESS_RANGE
from phase_traj_ros.core.camera.tuning import TUNING as CAMERA

# The grid: logarithms of the focal length in image widths, and straightnesses.
_FOCALS = np.linspace(math.log(0.12), math.log(4.0), 201)
_STRAIGHTS = np.linspace(*STRAIGHTNESS_RANGE, 47)
# Grid of the column of the principal point, in image widths from the centre.
_COLUMNS = np.linspace(-0.6, 0.6, 241)


class LensCalibration(SelfCalibration):
    """Learns lens and horizon of an unknown camera."""

    def _restart(self) -> None:
        usual = _normal(_FOCALS, math.log(TUNING.usual_focal), TUNING.focal_spread)
        pinholes = _normal(_STRAIGHTS, PINHOLE, TUNING.pinhole_deviation)
        fisheyes = _normal(_STRAIGHTS, TUNING.fisheye_straightness, TUNING.fisheye_deviation)
        share, cropped = TUNING.pinhole_share, TUNING.cropped_share
        self._log_lens: Numbers = np.log(
            usual[:, None] * (share * pinholes + (1.0 - share) * fisheyes))
        whole = _normal(_COLUMNS, 0.0, TUNING.column_deviation)
        self._log_column: Numbers = np.log((1.0 - cropped) * whole + cropped / np.ptp(_COLUMNS))
        self._horizon = HorizonEstimator()
        self._estimate: CameraEstimate | None = None

    @property
    def lens(self) -> Lens:
        """Return the lens that was learned."""
        return Lens(estimate=self.estimate)

    @property
    def estimate(self) -> CameraEstimate:
        """Return the current estimate for frames of the size so far; at first, the prior."""
        if self._estimate is not None:
            return self._estimate
        height, width = self._shape
        density = _density(self._log_lens)
        focal, focal_deviation = _moments(density.sum(axis=1), _FOCALS)
        straight, straight_deviation = _moments(density.sum(axis=0), _STRAIGHTS)
        column, column_deviation = _moments(_density(self._log_column), _COLUMNS * width)
        self._estimate = CameraEstimate(
            width=width, height=height, focal_px=math.exp(focal) * width,
            focal_deviation=math.hypot(focal_deviation, CAMERA.common_error),
            straightness=straight, straightness_deviation=straight_deviation,
            column_px=column, column_deviation_px=column_deviation,
            **self._horizon.horizon.degrees(), turns=self.turns)
        return self._estimate

    def _fits(self, tracks: TurnTracks) -> Iterator[TurnFit | None]:
        """Fit from the estimate; if that fails, from other start values."""
        width, known, fit = self._width, self.estimate, None
        if self.turns and known.focal_deviation < TUNING.known_focal_deviation:
            fit = fit_turn(
                tracks, [(known.focal_px, known.straightness, known.column_px)], width=width)
        for shares in (TUNING.guesses, TUNING.cropped_guesses):
            if fit is None or fit.cost > TUNING.good_cost:
                refit = fit_turn(tracks, guesses_for(shares, width), width=width)
                # Another camera has to explain clearly more than an ambiguous one.
                factor = TUNING.other_cost if fit is not None and fit.ambiguous else 1.0
                if fit is None or (refit is not None and factor * refit.cost < fit.cost):
                    fit = refit
        yield fit

    def _add(self, fit: TurnFit, tracks: TurnTracks) -> None:
        width = self._width
        self._log_lens += _log_likelihood(fit, width)
        own = TUNING.deviation_factor ** 2 * float(fit.covariance[2, 2]) / width ** 2
        variance = TUNING.column_error ** 2 + own
        self._log_column += _log_student((_COLUMNS - fit.column / width) ** 2 / variance, 1)
        chord = 2.0 * max(abs(math.sin(fit.angle / 2.0)), 0.05)
        self._horizon.add_turn(fit.down, TUNING.axis_error / chord)
        self._estimate = None


def _normal(values: Numbers, mean: float, deviation: float) -> Numbers:
    scaled = np.exp(-0.5 * ((values - mean) / deviation) ** 2)
    return np.asarray(scaled / (deviation * math.sqrt(2.0 * math.pi)), np.float64)


def _density(log: Numbers) -> Numbers:
    density = np.exp(log - log.max())
    return np.asarray(density / density.sum(), np.float64)


def _log_student(distance: Numbers, dimensions: int) -> Numbers:
    """Return the log of Student's distribution at squared distances, in standard deviations."""
    freedom = TUNING.degrees_of_freedom
    return np.asarray(-(freedom + dimensions) / 2.0 * np.log1p(distance / freedom), np.float64)


def _moments(density: Numbers, values: Numbers) -> tuple[float, float]:
    mean = float(density @ values)
    return mean, math.sqrt(float(density @ (values - mean) ** 2))


def _log_likelihood(fit: TurnFit, width: int) -> Numbers:
    """Return the log-likelihood of a fit for each focal length and straightness of the grid."""
    covariance = TUNING.deviation_factor ** 2 * max(fit.cost, 1.0) * fit.covariance[:2, :2]
    covariance = covariance + np.diag(np.square((TUNING.focal_error, TUNING.straightness_error)))
    inverse = np.linalg.inv(covariance)
    focal = (_FOCALS - (fit.log_focal - math.log(width)))[:, None]
    straight = (_STRAIGHTS - fit.straightness)[None, :]
    distance = (
        inverse[0, 0] * focal * focal + 2.0 * inverse[0, 1] * focal * straight
        + inverse[1, 1] * straight * straight)
    return _log_student(distance, 2)
