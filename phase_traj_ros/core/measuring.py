# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures each pair of frames in every way that the settings ask for."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from phase_traj_ros.core.correlation.mask import check_size, mask_shares, mask_weights
from phase_traj_ros.core.correlation.phase_correlation import (
    check_frame,
    Frame,
    PhaseCorrelator,
    Shift,
)
from phase_traj_ros.core.correlation.quality import GateSettings, PairQuality, Worth
from phase_traj_ros.core.heading.estimator import HeadingEstimator
from phase_traj_ros.core.heading.yaw_meter import YawMeasurement
from phase_traj_ros.core.settings import CodeSource, EstimatorSettings


# Standard deviations by which a shift has to stand out of noise to be one.
_STANDS_OUT = GateSettings().min_significance


@dataclass(frozen=True, slots=True)
class Comparison:
    """What two frames tell: nothing, where they cannot be compared."""

    shift: Shift | None = None
    """Shift of the view, in its own pixels."""
    yaw: YawMeasurement | None = None
    """Yaw, where a lens is given."""


class PairMeter:
    """Holds the newest frame, in the form that each measurement needs, and measures the next."""

    def __init__(self, settings: EstimatorSettings, *, mask: ArrayLike | None) -> None:
        """
        Make a meter that waits for its first frame.

        Raises
        ------
        ValueError
            The mask is not usable (see ``mask_shares``), or it is empty within the view.

        """
        self._mask = None if mask is None else mask_shares(mask)
        self._settings = settings
        self.check(settings)
        self._form: tuple[tuple[int, ...], str, str] | None = None
        self._apply()

    @property
    def mask(self) -> NDArray[np.float32] | None:
        """Return how much each pixel of the frames counts, (H, W) from 0 to 1; None: all alike."""
        return self._mask

    def check(self, settings: EstimatorSettings) -> None:
        """
        Make sure that the view of these settings and the mask go together.

        Raises
        ------
        ValueError
            The mask is empty within the view.

        """
        if self._mask is None:
            return
        try:
            mask_weights(settings.view.of(self._mask))
        except ValueError as error:
            raise ValueError(
                f'{error}, within the band of rows and columns: give a wider band, or a mask that'
                ' covers less') from None

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Go on with other settings, which ``check`` has accepted."""
        before = self._settings
        self._settings = settings
        if (settings.window, settings.view, settings.code_source) != (
                before.window, before.view, before.code_source):
            self._apply()
        elif (settings.gate, settings.stillness) != (before.gate, before.stillness):
            self._quality = self._make_quality()

    def reset(self) -> None:
        """Forget the newest frame: the next one has none to be compared with."""
        self._correlator.reset()
        self._quality.reset()

    def interrupt(self) -> None:
        """Keep the newest frame, and forget what was seen before it, as after a gap."""
        self._quality.interrupt()

    def compare(
        self, frame: Frame, interval: float, *, encoding: str, heading: HeadingEstimator | None,
    ) -> Comparison:
        """
        Compare a frame with the one before it, ``interval`` seconds earlier.

        Raises
        ------
        FrameError
            The frame cannot be used. It is as if it had never come.

        """
        view = self._settings.view.of(frame)
        # Whatever can refuse the frame comes first, and only the last of it may change anything.
        if self._correlates or self._quality.looks_at_frames:
            # The heading may do with a frame that has nothing in the view.
            check_frame(view)
            if self._view_mask is not None:
                check_size(view, self._view_mask)
        yaw = None if heading is None else heading.measure(frame, interval)
        shift = self._correlator.update(view) if self._correlates else None
        self._quality.update(view)
        form = (frame.shape, frame.dtype.str, encoding)
        alike, self._form = form == self._form, form
        if alike:
            return Comparison(shift, yaw)
        self._quality.interrupt()
        return Comparison()

    def worth(self, comparison: Comparison) -> tuple[Worth | None, Shift | None]:
        """
        Return what the newest pair is worth, and the shift of the view to judge it by.

        The worth is None if the two frames cannot be compared.
        """
        measured = comparison.shift
        if not self._correlates:
            measured = None if comparison.yaw is None else comparison.yaw.shift
        if measured is None:
            return None, None
        return self._quality.judge(measured, self._correlator)

    def agreement(self, comparison: Comparison) -> float | None:
        """
        Return which share of the picture agrees on how it has moved; None if nobody knows.

        Without blocks to ask, all of it does where the shift stands out of noise, else none.
        """
        if comparison.yaw is not None:
            return comparison.yaw.agreement
        if comparison.shift is None:
            return None
        return float(self._correlator.significance(comparison.shift) >= _STANDS_OUT)

    def correlation_map(self) -> NDArray[np.float32]:
        """Return the map of the newest pair, as ``PhaseCorrelator.correlation_map`` does."""
        return self._correlator.correlation_map()

    @property
    def _correlates(self) -> bool:
        return self._settings.code_source is CodeSource.SHIFT

    def _apply(self) -> None:
        settings = self._settings
        self._view_mask: Frame | None = (
            None if self._mask is None else settings.view.of(self._mask))
        self._correlator = PhaseCorrelator(
            window=settings.window, mask=self._view_mask, transform=settings.transform)
        self._quality = self._make_quality()

    def _make_quality(self) -> PairQuality:
        # The yaw has tests of its own, and no map of the view to be judged by.
        return PairQuality(
            gate=self._settings.gate if self._correlates else None,
            stillness=self._settings.stillness, mask=self._view_mask)
