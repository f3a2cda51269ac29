# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Learns where the centre of a lens is whose focal length is given, from fits to the turns."""

from collections.abc import Iterator
from dataclasses import replace
import math
from statistics import median

import numpy as np
from phase_traj_ros.core.calibration.self_calibration import guesses_for, SelfCalibration
from phase_traj_ros.core.calibration.tuning import TUNING
from phase_traj_ros.core.calibration.turn_fit import fit_turn, TurnFit
from phase_traj_ros.core.calibration.turn_tracks import TurnTracks
from phase_traj_ros.core.camera.lens import Lens


class ColumnCalibration(SelfCalibration):
    """Learns the column of a given lens, and whether the turns contradict it."""

    def __init__(self, given: Lens) -> None:
        """Start with a lens that has a focal length."""
        self._given = given
        super().__init__()

    def _restart(self) -> None:
        self._column: ColumnFilter | None = None
        if width := self._width:
            self._column = ColumnFilter(
                self._given.focal_for(width), self._given.straightness, width)

    @property
    def lens(self) -> Lens:
        """Return the given lens with the column that was learned."""
        if self._column is None:
            return self._given
        return replace(self._given, offset=self._column.column / self._width)

    @property
    def settled(self) -> bool:
        """Return whether the column is known, and nothing contradicts the lens."""
        return self._column is not None and not self.contradicted and (
            self._column.deviation < TUNING.known_column * self._width)

    @property
    def contradicted(self) -> bool:
        """Return whether the turns contradict the lens that was given."""
        return self._column is not None and self._column.contradicted

    def _fits(self, tracks: TurnTracks) -> Iterator[TurnFit | None]:
        """Fit from the given lens; if that fails or costs much, from other start values."""
        assert self._column is not None
        width = self._width
        given = self._given.focal_for(width), self._given.straightness, self._column.column
        fits = [fit_turn(tracks, [given], width=width)]
        if fits[0] is None or fits[0].cost > TUNING.given_cost:
            fits.append(fit_turn(tracks, guesses_for(TUNING.guesses, width), width=width))
        yield from sorted(filter(None, fits), key=lambda fit: fit.cost)

    def _add(self, fit: TurnFit, tracks: TurnTracks) -> None:
        assert self._column is not None
        turned = abs(float(tracks.flow[-1])) / self._given.focal_for(self._width)
        judges = turned > TUNING.judging_yaw_rate * float(tracks.seconds[-1])
        self._column.add(fit, judges=judges)


class ColumnFilter:
    """
    A Kalman filter over the lenses that fit the turns (``TurnFit``).

    Its states are the logarithm of the focal length in pixels, the straightness, and the column in
    pixels. The first two are nearly known, which makes the column of a fit far more certain.
    """

    def __init__(self, focal_px: float, straightness: float, width: int) -> None:
        """Start with a lens whose principal point is at about the centre of its images."""
        self._width = width
        self._lens = np.array([math.log(focal_px), straightness, 0.0])
        self._covariance = np.diag(np.square([
            TUNING.given_focal_deviation, TUNING.given_straightness_deviation,
            TUNING.given_column_deviation * width]))
        # The given focal length and straightness, and the variances with which a fit, whatever
        # its noise, may differ from them. The least error of the straightness is as large, at the
        # edge of the image, as that of the focal length; a straightness of k moves points there
        # by k theta^2 / 3.
        self._given = self._lens[:2]
        least = TUNING.focal_error, max(
            TUNING.straightness_error, TUNING.focal_error * 3.0 / (width / 2 / focal_px) ** 2)
        self._given_variance = np.diag(self._covariance)[:2] + np.square(least)
        # By how many standard deviations the focal length and the straightness of the fits that
        # judge them are off.
        self._off: list[tuple[float, ...]] = []

    @property
    def column(self) -> float:
        """Return the column, in pixels to the right of the image centre."""
        return float(self._lens[2])

    @property
    def deviation(self) -> float:
        """Return its standard deviation in pixels."""
        return math.sqrt(float(self._covariance[2, 2]))

    @property
    def contradicted(self) -> bool:
        """
        Return whether the turns contradict the focal length or the straightness that was given.

        The fits of a drive share errors, so their mean is less certain than it seems: half of them
        have to contradict it, each by itself.
        """
        return any(abs(median(off)) > TUNING.contradiction_deviations for off in zip(*self._off))

    def add(self, fit: TurnFit, *, judges: bool = True) -> None:
        """
        Add the lens of a part of a turn.

        ``judges`` is whether it judges the given lens: in a gentle bend, the focal length is
        mostly too short.
        """
        noise = TUNING.deviation_factor ** 2 * max(fit.cost, 1.0) * fit.covariance
        if judges:
            apart = np.array([fit.log_focal, fit.straightness]) - self._given
            deviations = np.sqrt(self._given_variance + np.diag(noise)[:2])
            self._off.append(tuple((apart / deviations).tolist()))
        errors = (0.0, 0.0, TUNING.given_column_error * self._width)
        noise = noise + np.diag(np.square(errors))
        innovation = np.array([fit.log_focal, fit.straightness, fit.column]) - self._lens
        off = float(innovation @ np.linalg.solve(self._covariance + noise, innovation))
        # A fit that contradicts the given lens counts less.
        noise *= max(1.0, off / TUNING.given_gate ** 2)
        gain = np.linalg.solve(self._covariance + noise, self._covariance).T
        self._lens = self._lens + gain @ innovation
        self._covariance = self._covariance - gain @ self._covariance
