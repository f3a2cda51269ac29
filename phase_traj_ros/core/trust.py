# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How far a drive can be trusted: what is fixed to the camera, cuts, and what pairs are worth."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.codes.threshold_hint import ShiftSummary, ThresholdHint
from phase_traj_ros.core.correlation.fixed_areas import FixedAreas
from phase_traj_ros.core.correlation.phase_correlation import Frame, Shift
from phase_traj_ros.core.correlation.quality import Worth
from phase_traj_ros.core.heading.cuts import CutDetector
from phase_traj_ros.core.heading.estimator import HeadingUpdate
from phase_traj_ros.core.heading.yaw_meter import YawMeasurement
from phase_traj_ros.core.reliability import evidence_of, Reliability, ReliabilityMonitor


# What covers a smaller share of the picture does no harm, and a mask costs time.
_WORTH_IT = 0.01


class Trust:
    """
    Watches the pairs of a drive, and says which of them are not to be believed.

    With ``guards`` it looks for fixed areas and for cuts, and its word counts. Without them it
    changes nothing: it sums up what the pairs are worth.
    """

    def __init__(self, *, guards: bool) -> None:
        """Make one that has seen nothing."""
        self._guards = guards
        self._areas = FixedAreas()
        self._cuts = CutDetector()
        self._monitor = ReliabilityMonitor()
        self._shifts = ShiftSummary()
        self._width = 0
        self.reset()

    def reset(self) -> None:
        """Start anew with the next frame; what is fixed to the camera is still known."""
        self._areas.interrupt()
        self._cuts.reset()
        self._monitor.reset()
        self._shifts.reset()
        self._doubted = self._turned = False

    @property
    def left_out(self) -> NDArray[np.uint8] | None:
        """Return what counts of the frames, (H, W): 0 where it is fixed; None if nothing is."""
        return self._areas.weights() if self.leaves_out else None

    @property
    def leaves_out(self) -> bool:
        """Return whether anything of the frames is left out."""
        return self._areas.share >= _WORTH_IT

    @property
    def turned(self) -> bool:
        """Return whether there has been a turn, so that angles matter."""
        return self._turned

    @property
    def hint(self) -> ThresholdHint | None:
        """Return what to do about a threshold that does not fit; None if nothing shows."""
        return self._shifts.hint(self._width)

    def verdict(self, *, camera_known: bool) -> Reliability:
        """Return what there is to say of the drive so far."""
        return self._monitor.verdict(camera_known=camera_known or not self._turned)

    def look(self, frame: Frame, shift: Shift | None, interval: float) -> bool:
        """
        Take the next frame; return whether what is to be left out of the frames has changed.

        Parameters
        ----------
        frame
            (H, W), as the camera gives it.
        shift
            By how many of its pixels the picture has moved since the frame before; None if they
            cannot be compared.
        interval
            Seconds since then.

        """
        self._width = frame.shape[1]
        if not self._guards:
            return False
        if shift is None:
            self._areas.interrupt()
            return self._areas.update(frame, 0.0)
        before = self.leaves_out
        # Of hardly anything nothing can be measured: it is left as it was.
        changed = self._areas.update(
            frame, interval, turned=shift.dx) and self._areas.sufficient
        return changed and (before or self.leaves_out)

    def finds_cut(self, measured: YawMeasurement | None, interval: float) -> bool:
        """Take the next pair; return whether the scene has changed in the pair before it."""
        cut = self._cuts.update(measured, interval)
        if cut:
            self._monitor.add_cut()
            self._areas.interrupt()
        return cut and self._guards

    def believed(
        self, measured: YawMeasurement | None, shift: Shift | None, worth: Worth | None,
    ) -> YawMeasurement | None:
        """Return what a pair tells of the yaw, as far as that is to be believed."""
        self._doubted = False
        if measured is None or shift is None:
            return measured
        if worth is Worth.STILL:
            # Whatever passes by: a vehicle that stands still does not turn.
            return replace(measured, yaw=0.0)
        self._doubted = self._guards and (
            not self._areas.sufficient or self._areas.doubts(shift, agreed=measured.refined))
        return replace(measured, yaw=None) if self._doubted else measured

    def add(
        self, agreement: float | None, worth: Worth | None, heading: HeadingUpdate | None,
        interval: float,
    ) -> None:
        """
        Take what a pair is worth.

        Parameters
        ----------
        agreement
            Share of the picture that agrees on its motion; None if it was not measured.
        worth
            What the frames tell; None if they cannot be compared.
        heading
            What the pair adds to the heading, where that is measured.
        interval
            Between the two frames, in seconds.

        """
        if heading is not None:
            self._turned |= bool(heading.quarters or heading.turns)
        self._monitor.add(evidence_of(
            agreement=None if worth is None else agreement, still=worth is Worth.STILL,
            blank=worth is Worth.NOTHING or (self._guards and self._areas.blank),
            fixed=self._doubted, bridged=heading is not None and not heading.measured), interval)

    def add_shift(self, dx: float | None, threshold: float | None, interval: float) -> None:
        """Take the shift of a pair, None if it was not measured, and what it is judged by."""
        if threshold is None:
            return
        if dx is None:
            self._shifts.miss()
        else:
            self._shifts.add(dx, threshold, interval=interval)
