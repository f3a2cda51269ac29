# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures each pair of frames: its shift, its yaw and its quality."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from phase_traj_ros.core.correlation.mask import check_size, mask_shares
from phase_traj_ros.core.correlation.phase_correlation import (
    check_form,
    Frame,
    PhaseCorrelator,
    Shift,
)
from phase_traj_ros.core.correlation.quality import GateSettings, PairQuality, Quality
from phase_traj_ros.core.heading.cuts import CutDetector
from phase_traj_ros.core.heading.yaw_camera import YawCamera
from phase_traj_ros.core.rotation.yaw_meter import YawMeasurement
from phase_traj_ros.core.settings import EstimatorSettings


# Significance of a valid shift, in standard deviations of noise.
_MIN_SIGNIFICANCE = GateSettings().min_significance


@dataclass(frozen=True, slots=True)
class Comparison:
    """The measurements of a pair; without any if its frames cannot be compared."""

    shift: Shift | None = None
    """Shift of the view, in its pixels, as measured."""
    yaw: YawMeasurement | None = None
    """Yaw, if a lens is given."""
    quality: Quality | None = None
    """Quality of the pair by its frames alone; None if they cannot be compared."""
    used: Shift | None = None
    """Shift of the view, or of the cylinder, to use for the pair."""
    agreement: float = 0.0
    """Share of the image that agrees on its motion, 0 to 1; without blocks, 0 or 1."""
    gap: bool = False
    """Whether the interval between the frames exceeds the limit."""
    cut: bool = False
    """Whether the scene changed in the pair before."""


class PairMeter:
    """Compares each frame with the previous one, by all measurements."""

    def __init__(self, settings: EstimatorSettings, *, mask: ArrayLike | None) -> None:
        """
        Make a meter that waits for its first frame.

        Raises
        ------
        ValueError
            The mask is invalid (see ``mask_shares``), or it is empty within the view.

        """
        self.mask = None if mask is None else mask_shares(mask)
        """Weight of each pixel, (H, W), 0 to 1; None if all count equally."""
        self._settings = settings
        self.check(settings)
        self._format: tuple[tuple[int, ...], str, str] | None = None
        self._cuts = CutDetector()
        self._excluded: NDArray[np.uint8] | None = None
        self._rebuild()

    def check(self, settings: EstimatorSettings) -> None:
        """
        Check that the mask leaves a part of the view of these settings.

        Raises
        ------
        ValueError
            The mask is empty within the view.

        """
        if self.mask is not None and not settings.view.of(self.mask).any():
            raise ValueError(
                f'mask is empty (0 everywhere) with a decimation of {settings.view.decimation}:'
                ' give less, or a mask that covers less')

    def reconfigure(self, settings: EstimatorSettings) -> None:
        """Apply other settings, which ``check`` has accepted."""
        before = self._settings
        self._settings = settings
        if (settings.view, settings.code_source) != (before.view, before.code_source):
            self._rebuild()
        elif (settings.gate, settings.stillness) != (before.gate, before.stillness):
            self._make_quality()

    def reset(self) -> None:
        """Forget the newest frame: the next one becomes the first of a pair."""
        self._correlator.reset()
        self._make_quality()
        self._cuts.reset()

    def exclude(self, weights: NDArray[np.uint8] | None) -> None:
        """Ignore areas fixed to the camera where a vehicle may stand; (H, W), 0 to 255."""
        self._excluded = weights
        self._quality.exclude(None if weights is None else self._settings.view.of(weights))

    def can_compare(self, frame: Frame, interval: float, encoding: str) -> bool:
        """Return whether a frame is of the form of the newest one, and no gap separates them."""
        return self._format == (frame.shape, frame.dtype.str, encoding) and not self._gap(interval)

    def compare(
        self, frame: Frame, picture: NDArray[np.uint8], waited: float, interval: float, *,
        encoding: str, camera: YawCamera | None, stood: bool = False,
    ) -> Comparison:
        """
        Compare a frame with the newest one that was compared, ``waited`` seconds earlier.

        ``picture`` is the frame as ``prepare`` returns it, ``interval`` the seconds since the
        previous frame, which need not have been compared. ``stood`` is whether the vehicle is
        known to have stood then.

        Raises
        ------
        FrameError
            The frame cannot be used. The state is unchanged.

        """
        view = self._settings.view.of(frame)
        # All checks come first, because an error must leave the state unchanged.
        if not self._settings.by_heading or self._quality.needs_frames:
            # The yaw may be measured on a frame that is too small for the view.
            check_form(view)
            if self._view_mask is not None:
                check_size(view, self._view_mask)
        yaw = None if camera is None else camera.measure(
            picture, waited, stood=stood and self._settings.guards)
        shift = None if self._settings.by_heading else self._correlator.update(view)
        self._quality.update(view)
        frame_format = (frame.shape, frame.dtype.str, encoding)
        same_format, self._format = frame_format == self._format, frame_format
        gap = self._gap(interval)
        if gap or not same_format:
            self._quality.interrupt()
            self._cuts.reset()
            return Comparison(gap=gap)
        cut = self._cuts.update(yaw, interval)
        if cut and self._settings.guards:
            self._quality.interrupt()
        measured = yaw.shift if self._settings.by_heading and yaw is not None else shift
        if measured is None:
            return Comparison(shift, yaw, cut=cut)
        quality, used = self._quality.judge(measured, self._correlator)
        if yaw is not None:
            agreement = yaw.agreement
        else:
            agreement = float(self._correlator.significance(measured) >= _MIN_SIGNIFICANCE)
        return Comparison(shift, yaw, quality, used, agreement, cut=cut)

    def correlation_map(self) -> NDArray[np.float32]:
        """Return the correlation map of the newest pair, see ``PhaseCorrelator``."""
        return self._correlator.correlation_map()

    def _gap(self, interval: float) -> bool:
        return 0.0 < self._settings.max_gap < interval

    def _rebuild(self) -> None:
        settings = self._settings
        self._view_mask: Frame | None = (
            None if self.mask is None else settings.view.of(self.mask))
        self._correlator = PhaseCorrelator(mask=self._view_mask)
        self._make_quality()

    def _make_quality(self) -> None:
        # The yaw is tested separately, and without a correlation map of the view.
        self._quality = PairQuality(
            gate=None if self._settings.by_heading else self._settings.gate,
            stillness=self._settings.stillness, mask=self._view_mask)
        self.exclude(self._excluded)
