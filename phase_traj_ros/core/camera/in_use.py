# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera in use, its origin and its uncertainty."""

from dataclasses import dataclass, replace

from phase_traj_ros.core.camera.lens import Lens, LensOrigin
from phase_traj_ros.core.camera.tuning import TUNING


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraInUse:
    """
    The camera in use for frames of one size.

    ``interval_px`` and ``probability`` are None unless they are estimated: parameters and
    calibrations are assumed to be exact.
    """

    origin: LensOrigin
    """Origin of the values."""
    focal_px: float
    """Focal length in pixels of the full frame, per radian at the principal point."""
    hfov_deg: float
    """Horizontal field of view in degrees, from edge to edge."""
    straightness: float | None
    """Straightness: 1 for a pinhole, 0 for an equidistant fisheye; None if calibrated."""
    offset: float
    """Offset of the principal point to the right of the image centre, in image widths."""
    pitch_deg: float
    """Pitch in degrees, positive down."""
    roll_deg: float
    """Roll in degrees, positive right side down."""
    interval_px: tuple[float, float] | None = None
    """90 % interval of the focal length, in pixels."""
    probability: float | None = None
    """Probability that the focal length is correct within 5 %, 0 to 1."""
    turns: int | None = None
    """Number of turns, or parts of turns, used for the estimate."""

    @classmethod
    def of(cls, lens: Lens, width: int) -> 'CameraInUse':
        """Return the camera with ``lens`` for frames ``width`` pixels wide."""
        camera, estimate = lens.camera, lens.estimate
        exact = cls(
            origin=lens.origin, focal_px=lens.focal_for(width), hfov_deg=lens.hfov_for(width),
            straightness=lens.straightness if camera is None else None,
            offset=lens.offset if camera is None else camera.offset,
            pitch_deg=lens.pitch_deg, roll_deg=lens.roll_deg)
        if estimate is None:
            return exact
        scale = width / estimate.width
        least, most = (end * scale for end in estimate.focal_interval_px)
        return replace(exact, interval_px=(least, most), probability=estimate.probability,
                       turns=estimate.turns)

    @property
    def settled(self) -> bool:
        """Return whether the focal length is known well enough to count quarter turns."""
        if self.origin is LensOrigin.ASSUMED:
            return False
        return self.interval_px is None or (
            self.interval_px[1] < TUNING.max_focal_ratio * self.interval_px[0])

    @property
    def most_angle(self) -> float:
        """Return the largest likely ratio of true angles to measured angles."""
        if self.origin is LensOrigin.ASSUMED:
            return TUNING.max_assumed_ratio
        return 1.0 if self.interval_px is None else self.focal_px / self.interval_px[0]

    def __str__(self) -> str:
        """Return a description of at most 128 characters, which ros2 topic echo prints whole."""
        focal = f'focal length {self.focal_px:.4g} px'
        if self.origin is LensOrigin.CALIBRATION:
            return f'{focal}, from the calibration'
        seen = f'field of view {self.hfov_deg:.0f} degrees, {focal}'
        if self.origin is LensOrigin.GIVEN:
            aside = f'; principal point {self.offset:+.1%} of the width' if self.offset else ''
            return f'{seen}, from the parameters{aside}'
        if self.interval_px is None:
            return f'{seen}, assumed until a turn determines it'
        (least, most), pitch = self.interval_px, round(self.pitch_deg, 1)
        turns = '1 part of a turn' if self.turns == 1 else f'{self.turns} parts of turns'
        return (
            f'{seen} (90 %: {least:.4g} to {most:.4g}), learned from {turns}; pitch'
            f' {abs(pitch)} deg {"down" if pitch >= 0 else "up"}')
