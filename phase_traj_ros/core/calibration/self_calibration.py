# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Learns the camera from the drive: from frames to an estimate of lens and horizon.

Fits to points tracked through turns (``turn_fit``) update a prior over cameras. It is a grid of
focal lengths and straightnesses, so a wrong fit is outvoted, and the memory is constant.
"""

from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.calibration.algebra import Numbers
from phase_traj_ros.core.calibration.column_filter import ColumnFilter
from phase_traj_ros.core.calibration.tuning import TUNING
from phase_traj_ros.core.calibration.turn_fit import fit_turn, TurnFit
from phase_traj_ros.core.calibration.turn_tracks import TurnTracker, TurnTracks
from phase_traj_ros.core.camera.estimate import CameraEstimate
from phase_traj_ros.core.camera.horizon import HorizonEstimator
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.camera.lens_family import PINHOLE, STRAIGHTNESS_RANGE
from phase_traj_ros.core.camera.tuning import TUNING as CAMERA
from phase_traj_ros.core.correlation.phase_correlation import Frame

# The grid: logarithms of the focal length in image widths, and straightnesses.
_FOCALS = np.linspace(math.log(0.12), math.log(4.0), 201)
_STRAIGHTS = np.linspace(*STRAIGHTNESS_RANGE, 47)
# Grid of the column of the principal point, in image widths from the centre.
_COLUMNS = np.linspace(-0.6, 0.6, 241)


class SelfCalibration:
    """
    Learns lens and horizon of a camera during the drive.

    Of a lens that is given, it learns the column of the principal point only, and whether the
    turns contradict its focal length. Deterministic: the same frames give the same estimate.
    """

    def __init__(self, given: Lens | None = None) -> None:
        """Make an estimator before the first frame; ``given`` is a lens with a focal length."""
        self.given = given
        """The lens that was given; None if all is learned."""
        self._column: ColumnFilter | None = None
        self._tracker = TurnTracker()
        # Shape of the frames; (0, 0) before the first.
        self._shape = (0, 0)
        # First and last stamp of all frames.
        self._stamp_range_ns: tuple[int, int] | None = None
        self._replayed = False
        self.forget()

    def forget(self) -> None:
        """Restart with the prior."""
        self._tracker.cut()
        usual = _normal(_FOCALS, math.log(TUNING.usual_focal), TUNING.focal_spread)
        pinholes = _normal(_STRAIGHTS, PINHOLE, TUNING.pinhole_deviation)
        fisheyes = _normal(_STRAIGHTS, TUNING.fisheye_straightness, TUNING.fisheye_deviation)
        share, cropped = TUNING.pinhole_share, TUNING.cropped_share
        self._log_lens: Numbers = np.log(
            usual[:, None] * (share * pinholes + (1.0 - share) * fisheyes))
        whole = _normal(_COLUMNS, 0.0, TUNING.column_deviation)
        self._log_column: Numbers = np.log((1.0 - cropped) * whole + cropped / np.ptp(_COLUMNS))
        self._horizon = HorizonEstimator()
        self.turns = 0
        """Number of parts of turns that were used."""
        self._frames, self._attempts = 0, 0
        self._estimate: CameraEstimate | None = None
        if self.given is not None and self._shape != (0, 0):
            width = self._shape[1]
            self._column = ColumnFilter(
                self.given.focal_for(width), self.given.straightness, width)

    def use_mask(self, mask: NDArray[np.uint8] | None) -> None:
        """Use another mask (H, W), 0 for ignored pixels, for turns that start from now on."""
        self._tracker.mask = mask

    def cut(self) -> None:
        """Do not track points from the last frame to the next; the estimate is kept."""
        self._tracker.cut()

    def add_stamp(self, stamp_ns: int) -> None:
        """
        Record the stamp of the newest frame.

        A repeated recording, such as a bag in a loop, adds no evidence: nothing is learned while
        the stamps are within the range already seen.
        """
        first, last = self._stamp_range_ns or (stamp_ns, stamp_ns - 1)
        self._replayed = first <= stamp_ns <= last
        self._stamp_range_ns = min(first, stamp_ns), max(last, stamp_ns)
        if self._replayed:
            self._tracker.cut()

    def update(
        self, frame: Frame, shift_px: float, interval: float, *, reverses: bool | None = None,
    ) -> bool:
        """
        Add the next frame, (H, W) and upright; return whether the estimate has changed.

        The frame must not change afterwards; one of another size is from another camera.
        ``shift_px`` is the shift of the image to the right since the last frame, 0 if it is
        unknown, and ``interval`` the time since in seconds, 0 for the first frame. ``reverses`` is
        whether the vehicle moved backwards in it; None if it hardly moved, or that is unknown.
        """
        if self._replayed:
            return False
        shape = (frame.shape[0], frame.shape[1])
        if shape != self._shape:
            self._shape = shape
            self.forget()
        self._frames += 1
        further = max(0, self._attempts + 1 - TUNING.free_fits)
        wanted = self._frames >= TUNING.fit_spacing_frames * further ** 2
        return self._learn(self._tracker.update(
            frame, shift_px, interval, reverses=reverses, wanted=wanted))

    def finish(self) -> None:
        """Use the turn in progress at the end."""
        self._learn(self._tracker.finish())

    @property
    def settled(self) -> bool:
        """Return whether nothing remains to be learned."""
        return self._column is not None and not self.contradicted and (
            self._column.deviation < TUNING.known_column * self._shape[1])

    @property
    def contradicted(self) -> bool:
        """Return whether the turns contradict the focal length that was given."""
        return self._column is not None and self._column.contradicted

    @property
    def lens(self) -> Lens:
        """Return the lens that was learned."""
        if self.given is None or self._column is None:
            return Lens(estimate=self.estimate)
        return replace(self.given, offset=self._column.column / self._shape[1])

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

    def _learn(self, tracks: TurnTracks | None) -> bool:
        """Fit a part of a turn, if there is one, and add the result."""
        if tracks is None:
            return False
        self._attempts += 1
        width = self._shape[1]
        fit = self._fit(tracks, width)
        if fit is None:
            return False
        self.turns += 1
        if self.given is not None and self._column is not None:
            turned = abs(float(tracks.flow[-1])) / self.given.focal_for(width)
            judges = turned > TUNING.judging_yaw_rate * float(tracks.seconds[-1])
            self._column.add(fit, judges=judges)
            return True
        self._log_lens += _log_likelihood(fit, width)
        own = TUNING.deviation_factor ** 2 * float(fit.covariance[2, 2]) / width ** 2
        variance = TUNING.column_error ** 2 + own
        self._log_column += _log_student((_COLUMNS - fit.column / width) ** 2 / variance, 1)
        chord = 2.0 * max(abs(math.sin(fit.angle / 2.0)), 0.05)
        self._horizon.add_turn(fit.down, TUNING.axis_error / chord)
        self._estimate = None
        return True

    def _fit(self, tracks: TurnTracks, width: int) -> TurnFit | None:
        """Fit from the given lens or the estimate; if that fails, from other start values."""
        starts, cropped_starts = (
            [(focal * width, straightness, column * width)
             for focal, straightness, column in guesses]
            for guesses in (TUNING.guesses, TUNING.cropped_guesses))
        fit = None
        if self.given is not None and self._column is not None:
            lens = self.given.focal_for(width), self.given.straightness, self._column.column
            fit = self._usable(fit_turn(tracks, [lens], width=width), tracks, width)
            return fit or self._usable(fit_turn(tracks, starts, width=width), tracks, width)
        if self.turns and self.estimate.focal_deviation < TUNING.known_focal_deviation:
            known = self.estimate
            fit = fit_turn(
                tracks, [(known.focal_px, known.straightness, known.column_px)], width=width)
        for guesses in (starts, cropped_starts):
            if fit is None or fit.cost > TUNING.good_cost:
                refit = fit_turn(tracks, guesses, width=width)
                # Another camera has to explain clearly more than an ambiguous one.
                factor = TUNING.other_cost if fit is not None and fit.ambiguous else 1.0
                if fit is None or (refit is not None and factor * refit.cost < fit.cost):
                    fit = refit
        return self._usable(fit, tracks, width)

    def _usable(self, fit: TurnFit | None, tracks: TurnTracks, width: int) -> TurnFit | None:
        """Return a fit to the points of the static scene; None if it is not usable."""
        if fit is None or fit.ambiguous:
            return None
        if fit.cost > TUNING.max_cost:
            static = fit.point_costs < TUNING.max_cost
            if static.mean() < TUNING.min_static:
                return None
            lens = math.exp(fit.log_focal), fit.straightness, fit.column
            fit = fit_turn(tracks.of(static), [lens], width=width)
        if fit is None or fit.cost > TUNING.max_cost:
            return None
        return fit if math.sqrt(fit.covariance[0, 0]) < TUNING.max_deviation else None


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
