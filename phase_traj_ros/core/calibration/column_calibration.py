# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Fits a lens whose focal length is given to the turns, to learn where its centre is."""

from collections.abc import Iterator
from dataclasses import replace

from phase_traj_ros.core.calibration.column_filter import ColumnFilter
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
        """Fit from the given lens; if that fails, from other start values."""
        assert self._column is not None
        width = self._width
        given = self._given.focal_for(width), self._given.straightness, self._column.column
        yield fit_turn(tracks, [given], width=width)
        yield fit_turn(tracks, guesses_for(TUNING.guesses, width), width=width)

    def _add(self, fit: TurnFit, tracks: TurnTracks) -> None:
        assert self._column is not None
        turned = abs(float(tracks.flow[-1])) / self._given.focal_for(self._width)
        judges = turned > TUNING.judging_yaw_rate * float(tracks.seconds[-1])
        self._column.add(fit, judges=judges)
