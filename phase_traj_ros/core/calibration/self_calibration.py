# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Learns a camera from the drive: from frames to fits of its lens to the turns (``turn_fit``).

``LensCalibration`` learns an unknown camera from the fits, ``ColumnCalibration`` the column of the
principal point of a given lens.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.calibration.tuning import TUNING
from phase_traj_ros.core.calibration.turn_fit import fit_turn, TurnFit
from phase_traj_ros.core.calibration.turn_tracks import TurnTracker, TurnTracks
from phase_traj_ros.core.camera.estimate import CameraEstimate
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.correlation.phase_correlation import Frame

Guess = tuple[float, float, float]
"""Start value of a fit: focal length in pixels, straightness, and column in pixels."""


class SelfCalibration(ABC):
    """
    Fits a lens to points tracked through each part of a turn.

    Deterministic: the same frames give the same result.
    """

    def __init__(self) -> None:
        """Start before the first frame."""
        self._tracker = TurnTracker()
        # Shape of the frames; (0, 0) before the first.
        self._shape = (0, 0)
        self._replayed = False
        self.forget()

    def forget(self) -> None:
        """Restart with what was known at the start."""
        self._tracker.cut()
        self.turns = 0
        """Number of parts of turns that were used."""
        # First and last stamp of these parts, and how long the newest lasted if its stamp is not
        # known yet.
        self._used_range_ns: tuple[int, int] | None = None
        self._newest_lasted_ns = 0
        self._frames, self._attempts = 0, 0
        self._restart()

    @property
    @abstractmethod
    def lens(self) -> Lens:
        """Return the lens that was learned."""

    @property
    def estimate(self) -> CameraEstimate | None:
        """Return the camera that was learned; None if its lens was given."""
        return None

    @property
    def settled(self) -> bool:
        """Return whether nothing remains to be learned."""
        return False

    @property
    def contradicted(self) -> bool:
        """Return whether the turns contradict the lens that was given."""
        return False

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
        the stamps are within the range of the turns that were used.
        """
        first, last = self._used_range_ns or (stamp_ns, stamp_ns - 1)
        self._replayed = first <= stamp_ns <= last
        if self._replayed:
            self._tracker.cut()
        if self._newest_lasted_ns:
            self._used_range_ns = (
                min(first, stamp_ns - self._newest_lasted_ns), max(last, stamp_ns))
            self._newest_lasted_ns = 0

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
    def _width(self) -> int:
        """Return the width of the frames in pixels."""
        return self._shape[1]

    @abstractmethod
    def _restart(self) -> None:
        """Restart with what was known at the start, for frames of the size so far."""

    @abstractmethod
    def _fits(self, tracks: TurnTracks) -> Iterator[TurnFit | None]:
        """Yield fits, of which the first usable one counts; None for one that fails."""

    @abstractmethod
    def _add(self, fit: TurnFit, tracks: TurnTracks) -> None:
        """Add the fit of a part of a turn."""

    def _learn(self, tracks: TurnTracks | None) -> bool:
        """Fit a part of a turn, if there is one, and add the result."""
        if tracks is None:
            return False
        self._attempts += 1
        fits = (_usable(fit, tracks, self._width) for fit in self._fits(tracks))
        fit = next(filter(None, fits), None)
        if fit is None:
            return False
        self.turns += 1
        self._newest_lasted_ns = round(1e9 * float(tracks.seconds[-1]))
        self._add(fit, tracks)
        return True


def guesses_for(shares: Sequence[Guess], width: int) -> list[Guess]:
    """Return start values whose focal lengths and columns are given in widths of the images."""
    return [(focal * width, straightness, column * width)
            for focal, straightness, column in shares]


def _usable(fit: TurnFit | None, tracks: TurnTracks, width: int) -> TurnFit | None:
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
