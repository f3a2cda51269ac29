# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The camera from the drive itself: frames in, an estimate of lens and horizon out.

What tells most is how points move through the picture in a turn (``turn_fit``). Beside it count
what is known of cameras beforehand and, a little, that streets mostly turn by right angles. All
of it is collected as the probability of each focal length and straightness on a grid; so a fit
that went wrong is outvoted, and memory does not grow.
"""

import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.calibration.right_angles import RightAngles
from phase_traj_ros.core.calibration.turn_fit import fit_turn, TurnFit
from phase_traj_ros.core.calibration.turn_tracks import TurnFollower, TurnTracks
from phase_traj_ros.core.camera.estimate import CameraEstimate
from phase_traj_ros.core.camera.horizon import HorizonEstimator
from phase_traj_ros.core.camera.lens_family import PINHOLE, STRAIGHTNESS_RANGE
from phase_traj_ros.core.correlation.phase_correlation import Frame

# The grid: logarithms of the focal length in widths of the picture, and straightnesses.
_FOCALS = np.linspace(math.log(0.12), math.log(4.0), 201)
_STRAIGHTS = np.linspace(*STRAIGHTNESS_RANGE, 47)
# What is known of cameras beforehand: 75 degrees across or so; most are nearly pinholes.
_USUAL, _SPREAD = math.log(0.65), 0.5
_PINHOLES, _AS_PINHOLE, _FISHEYE, _AS_FISHEYE = 0.7, 0.1, 0.3, 0.5
# A fit is that much less sure than it says, and wrong by these besides; deviations far off are
# not rare (Student's distribution with so many degrees of freedom).
_UNSURE, _WRONG, _FREEDOM = 2.5, (0.03, 0.05), 4.0
# Of all drives of a camera alike: see ``estimate``.
_COMMON = 0.02
# Fits of a higher cost per sight, or less sure of the focal length than this, are of no use.
_MOST_COST, _LEAST_SURE = 3.0, 0.12
# Guesses: focal length and column of the principal point in widths, straightness between. Where
# none fits well, the pictures may be cut out of larger ones.
_GUESSES = ((0.23, 1.0, 0.0), (0.45, 0.6, 0.0), (0.9, 0.9, 0.0))
_CUT_OUT = ((0.9, 0.9, -0.45), (0.9, 0.9, 0.45))
# The principal point's column, in widths from the middle: it is there but for this deviation, if
# the pictures are not cut out of larger ones, as this share may be; and fits are wrong by this.
_COLUMNS = np.linspace(-0.6, 0.6, 241)
_OFF_MIDDLE, _CUTTINGS, _COLUMN_WRONG = 0.05, 0.02, 0.015
# Turns of a place are alike, be they right angles or not: each tells this much less.
_ANGLES_WEIGHT = 0.25
# From here on, the next fit starts at the estimate.
_KNOWN, _GOOD_COST = 0.08, 2.5
# Of all fits but the first ones, the n-th is not tried before so many frames times n squared: many
# turns tell no more.
_FREE, _FRAMES = 4, 40
# How far a vehicle pitches and rolls between the ends of a turn, in radians; the smaller the turn,
# the farther that moves its axis.
_SWAYS = math.radians(1.2)


class SelfCalibration:
    """
    Learns lens and horizon of a camera while it drives.

    Deterministic: the same frames give the same estimate.
    """

    def __init__(self, *, mask: NDArray[np.uint8] | None = None) -> None:
        """Make one that has seen nothing; ``mask`` (H, W) is 0 where it is not to look."""
        self._follower = TurnFollower(mask=mask)
        self._shape: tuple[int, int] | None = None
        self.forget()

    def forget(self) -> None:
        """Forget the camera, too."""
        self._follower.cut()
        usual = -0.5 * ((_FOCALS - _USUAL) / _SPREAD) ** 2
        kinds = (
            _PINHOLES / _AS_PINHOLE
            * np.exp(-0.5 * ((_STRAIGHTS - PINHOLE) / _AS_PINHOLE) ** 2)
            + (1.0 - _PINHOLES) / _AS_FISHEYE
            * np.exp(-0.5 * ((_STRAIGHTS - _FISHEYE) / _AS_FISHEYE) ** 2))
        self._log: NDArray[np.float64] = usual[:, None] + np.log(kinds)
        self._angles = RightAngles(_FOCALS, weight=_ANGLES_WEIGHT)
        self._horizon = HorizonEstimator()
        self._column: NDArray[np.float64] = np.log(
            (1.0 - _CUTTINGS) / (_OFF_MIDDLE * math.sqrt(2.0 * math.pi))
            * np.exp(-0.5 * (_COLUMNS / _OFF_MIDDLE) ** 2) + _CUTTINGS / np.ptp(_COLUMNS))
        self._frames, self._tried, self._fits = 0, 0, 0
        self._estimate: CameraEstimate | None = None

    def use_mask(self, mask: NDArray[np.uint8] | None) -> None:
        """Look at turns that begin from now on where ``mask`` (H, W) is not 0."""
        self._follower.mask = mask

    def cut(self) -> None:
        """Do not follow anything from the last frame to the next; what is learned is kept."""
        self._follower.cut()

    def update(self, frame: Frame, shift_px: float, interval: float) -> bool:
        """
        Take the next frame; return whether the estimate has changed.

        Parameters
        ----------
        frame
            (H, W), as the camera gives it; not to be changed afterwards. Of another size than
            before, it is another camera.
        shift_px
            By how many of its pixels the picture has moved to the right since the last frame; 0
            where that is not known.
        interval
            Seconds since the last frame; 0 for the first.

        """
        shape = (frame.shape[0], frame.shape[1])
        if shape != self._shape:
            self._shape = shape
            self.forget()
        self._frames += 1
        wanted = self._frames >= _FRAMES * max(0, self._tried + 1 - _FREE) ** 2
        return self._learn(self._follower.update(frame, shift_px, interval, wanted=wanted))

    def finish(self) -> bool:
        """Use the turn under way at the end; return whether the estimate has changed."""
        return self._learn(self._follower.finish())

    def add_turn(self, angle_deg: float, *, focal_px: float) -> None:
        """
        Take the angle of a turn, as measured with a focal length: it may be a right one.

        Raises
        ------
        ValueError
            The angle is not finite, or the focal length is not a finite number above 0.

        """
        width = 1 if self._shape is None else self._shape[1]
        self._angles.add(angle_deg, focal=focal_px / width)
        self._estimate = None

    def add_travel(self, slope: float, deviation: float) -> None:
        """Take the direction of travel on a straight, as ``HorizonEstimator`` does."""
        self._horizon.add_travel(slope, deviation)
        self._estimate = None

    @property
    def turns(self) -> int:
        """Return how many stretches of turns have been used."""
        return self._fits

    @property
    def estimate(self) -> CameraEstimate:
        """
        Return what is known by now; before the first turn, what is known of any camera.

        Raises
        ------
        ValueError
            There was no frame yet.

        """
        if self._shape is None:
            raise ValueError('there was no frame yet: give one before asking for the camera')
        if self._estimate is None:
            self._estimate = self._found(self._shape)
        return self._estimate

    def _found(self, shape: tuple[int, int]) -> CameraEstimate:
        density = _density(self._log + self._angles.log_likelihood[:, None])
        focal, focal_deviation = _moments(density.sum(axis=1), _FOCALS)
        straight, straight_deviation = _moments(density.sum(axis=0), _STRAIGHTS)
        column, column_deviation = _moments(_density(self._column), _COLUMNS)
        horizon = self._horizon.horizon
        height, width = shape
        return CameraEstimate(
            width=width, height=height, focal_px=math.exp(focal) * width,
            focal_deviation=math.hypot(focal_deviation, _COMMON), straightness=straight,
            straightness_deviation=straight_deviation, column_px=column * width,
            column_deviation_px=column_deviation * width,
            pitch_deg=math.degrees(horizon.pitch),
            pitch_deviation_deg=math.degrees(horizon.pitch_deviation),
            roll_deg=math.degrees(horizon.roll),
            roll_deviation_deg=math.degrees(horizon.roll_deviation), turns=self._fits)

    def _learn(self, tracks: TurnTracks | None) -> bool:
        """Fit a stretch of a turn, if there is one, and add what it tells."""
        if tracks is None or self._shape is None:
            return False
        self._tried += 1
        fit = self._fit(tracks, self._shape[1])
        if fit is None:
            return False
        self._fits += 1
        width = self._shape[1]
        self._log += _log_likelihood(fit, width)
        variance = _COLUMN_WRONG ** 2 + _UNSURE ** 2 * float(fit.covariance[2, 2]) / width ** 2
        self._column += _student((_COLUMNS - fit.column / width) ** 2 / variance, 1)
        chord = 2.0 * max(abs(math.sin(fit.angle / 2.0)), 0.05)
        self._horizon.add_turn(fit.down, _SWAYS / chord)
        self._estimate = None
        return True

    def _fit(self, tracks: TurnTracks, width: int) -> TurnFit | None:
        """Fit from what is known; where that fails, from ever more guesses."""
        fit = None
        if self._fits and self.estimate.focal_deviation < _KNOWN:
            known = self.estimate
            fit = fit_turn(
                tracks, [(known.focal_px, known.straightness, known.column_px)], width=width)
        for guesses in (_GUESSES, _CUT_OUT):
            if fit is None or fit.cost > _GOOD_COST:
                other = fit_turn(tracks, [
                    (focal * width, straightness, column * width)
                    for focal, straightness, column in guesses], width=width)
                if fit is None or (other is not None and other.cost < fit.cost):
                    fit = other
        if fit is None or fit.cost > _MOST_COST:
            return None
        return fit if math.sqrt(fit.covariance[0, 0]) < _LEAST_SURE else None


def _density(log: NDArray[np.float64]) -> NDArray[np.float64]:
    density = np.exp(log - log.max())
    return np.asarray(density / density.sum(), np.float64)


def _student(distance: NDArray[np.float64], dimensions: int) -> NDArray[np.float64]:
    """Return the logarithm of Student's distribution at squared distances, in deviations."""
    return np.asarray(
        -(_FREEDOM + dimensions) / 2.0 * np.log1p(distance / _FREEDOM), np.float64)


def _moments(density: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[float, float]:
    mean = float(density @ values)
    return mean, math.sqrt(float(density @ (values - mean) ** 2))


def _log_likelihood(fit: TurnFit, width: int) -> NDArray[np.float64]:
    """Return how likely a fit is for each focal length and straightness of the grid."""
    covariance = _UNSURE ** 2 * max(fit.cost, 1.0) * fit.covariance[:2, :2]
    covariance = covariance + np.diag(np.square(_WRONG))
    inverse = np.linalg.inv(covariance)
    focal = (_FOCALS - (fit.log_focal - math.log(width)))[:, None]
    straight = (_STRAIGHTS - fit.straightness)[None, :]
    distance = (
        inverse[0, 0] * focal * focal + 2.0 * inverse[0, 1] * focal * straight
        + inverse[1, 1] * straight * straight)
    return _student(distance, 2)
