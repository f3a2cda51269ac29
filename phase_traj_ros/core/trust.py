# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Decides which pairs of a drive can be trusted: fixed areas, cuts and quality."""

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
from phase_traj_ros.core.reliability import (
    Evidence,
    evidence_of,
    Reliability,
    ReliabilityMonitor,
)


# Smallest share of the image to mask out: smaller areas do no harm, and a mask costs time.
_WORTH_IT = 0.01


class Trust:
    """
    Watches the pairs of a drive and rejects those that cannot be trusted.

    With ``guards`` it detects fixed areas and cuts and acts on them. Without, it changes nothing
    and only sums up what the pairs are worth.
    """

    def __init__(self, *, guards: bool) -> None:
        """Make a monitor that has seen no frame."""
        self._guards = guards
        self._areas = FixedAreas()
        self._cuts = CutDetector()
        self._monitor = ReliabilityMonitor()
        self._shifts = ShiftSummary()
        self._width = 0
        self.reset()

    def reset(self) -> None:
        """Start again with the next frame; fixed areas stay known."""
        self._areas.interrupt()
        self._cuts.reset()
        self._monitor.reset()
        self._shifts.reset()
        self._doubted = self._turned = False

    @property
    def left_out(self) -> NDArray[np.uint8] | None:
        """Return the mask of the fixed areas, (H, W): 0 where fixed; None if nothing is."""
        return self._areas.weights() if self.leaves_out else None

    @property
    def leaves_out(self) -> bool:
        """Return whether a part of the frames is masked out."""
        return self._areas.share >= _WORTH_IT

    @property
    def turned(self) -> bool:
        """Return whether the vehicle has made a turn, so that angles matter."""
        return self._turned

    @property
    def hint(self) -> ThresholdHint | None:
        """Return what to do about a threshold that does not fit; None if it may fit."""
        return self._shifts.hint(self._width)

    def verdict(self, *, camera_known: bool) -> Reliability:
        """Return the verdict on the last minute, and the spans that are not reliable."""
        return self._monitor.verdict(camera_known=camera_known)

    def look(self, frame: Frame, shift: Shift | None, interval: float) -> bool:
        """
        Take the next frame; return whether ``left_out`` has changed.

        Parameters
        ----------
        frame
            (H, W), as the camera delivers it.
        shift
            Shift since the previous frame in pixels of the frame; None if the two cannot be
            compared.
        interval
            Seconds since the previous frame.

        """
        self._width = frame.shape[1]
        if not self._guards:
            return False
        if shift is None:
            self._areas.interrupt()
            return self._areas.update(frame, 0.0)
        before = self.leaves_out
        # If too little of the image would remain, the mask stays as it was.
        changed = self._areas.update(
            frame, interval, turned=shift.dx) and self._areas.sufficient
        return changed and (before or self.leaves_out)

    def finds_cut(self, measured: YawMeasurement | None, interval: float) -> bool:
        """Take the next pair; return whether the scene changed in the pair before it."""
        cut = self._cuts.update(measured, interval)
        if cut:
            self._monitor.add_cut()
            self._areas.interrupt()
        return cut and self._guards

    def believed(
        self, measured: YawMeasurement | None, shift: Shift | None, worth: Worth | None,
    ) -> YawMeasurement | None:
        """Return the measurement of a pair with its yaw, or without it if the yaw is rejected."""
        self._doubted = False
        if measured is None or shift is None:
            return measured
        if worth is Worth.STILL:
            # A stationary vehicle does not turn, whatever passes by.
            return replace(measured, yaw=0.0)
        self._doubted = self._guards and (
            not self._areas.sufficient or self._areas.doubts(shift, agreed=measured.refined))
        return replace(measured, yaw=None) if self._doubted else measured

    def add(
        self, agreement: float | None, worth: Worth | None, heading: HeadingUpdate | None,
        stamp_ns: int, interval_ns: int,
    ) -> None:
        """
        Take what a pair is worth.

        Parameters
        ----------
        agreement
            Share of the image that agrees on its motion; None if it was not measured.
        worth
            What the pair is worth; None if its frames cannot be compared.
        heading
            What the pair adds to the heading; None if the heading is not measured.
        stamp_ns
            Stamp of its second frame.
        interval_ns
            Time since its first frame.

        """
        if heading is not None:
            self._turned |= bool(heading.quarters or heading.turns)
        self._monitor.add(evidence_of(
            agreement=None if worth is None else agreement, still=worth is Worth.STILL,
            blank=worth is Worth.NOTHING or (self._guards and self._areas.blank),
            fixed=self._doubted, bridged=heading is not None and not heading.measured),
            stamp_ns, interval_ns,
            contradicted=self._guards and heading is not None and heading.contradicts)

    def add_repeated(self, stamp_ns: int, interval_ns: int) -> None:
        """Take a pair whose frames show the same picture."""
        self._monitor.add(Evidence.REPEATED, stamp_ns, interval_ns)

    def add_same_stamps(self, count: int) -> None:
        """Take frames with the stamp of the one before, which are not used."""
        self._monitor.add_same_stamps(count)

    def add_shift(self, dx: float | None, threshold: float | None, interval: float) -> None:
        """Take the shift of a pair (None if not measured) and its threshold (None if not used)."""
        if threshold is None:
            return
        if dx is None:
            self._shifts.miss()
        else:
            self._shifts.add(dx, threshold, interval=interval)
