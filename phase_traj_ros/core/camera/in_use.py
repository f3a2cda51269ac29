# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera that a drive is measured with: what it was taken for, from where, how sure."""

from dataclasses import dataclass

from phase_traj_ros.core.camera.lens import Lens, LensOrigin


# An interval wider than this, most over least, leaves open how many quarters a turn is.
_WIDEST = 1.5
# By so much may a camera that nothing is known of be wider than the usual one.
_FAR_OFF = 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraInUse:
    """
    A camera as it was taken for frames of one size.

    interval_px and probability are None where nobody has estimated them: numbers and calibrations
    are believed as they are.
    """

    origin: LensOrigin
    """Where the knowledge comes from."""
    focal_px: float
    """Focal length in pixels of the full frame, per radian in its middle."""
    hfov_deg: float
    """Horizontal field of view in degrees, from edge to edge."""
    straightness: float | None
    """Of the lens: 1 for a pinhole, 0 for an equidistant fisheye; None if it is calibrated."""
    offset: float
    """How far the principal point is to the right of the middle, in widths of the picture."""
    pitch_deg: float
    """How far the camera looks down."""
    roll_deg: float
    """How far its right side hangs down."""
    interval_px: tuple[float, float] | None = None
    """Between which focal lengths the true one is, with a probability of 90 %."""
    probability: float | None = None
    """How probable it is that the focal length is right within 5 %, 0 to 1."""
    turns: int | None = None
    """On how many turns, or stretches of turns, this rests."""

    @classmethod
    def of(cls, lens: Lens, width: int) -> 'CameraInUse':
        """Return what ``lens`` means for frames ``width`` pixels wide."""
        focal_px, hfov_deg, estimate = lens.focal_for(width), lens.hfov_for(width), lens.estimate
        if lens.calibrated and lens.camera is not None:
            return cls(
                origin=lens.origin, focal_px=focal_px, hfov_deg=hfov_deg, straightness=None,
                offset=lens.camera.offset, pitch_deg=lens.pitch_deg, roll_deg=lens.roll_deg)
        if lens.origin is not LensOrigin.DRIVE or estimate is None:
            return cls(
                origin=lens.origin, focal_px=focal_px, hfov_deg=hfov_deg,
                straightness=lens.straightness, offset=lens.offset, pitch_deg=lens.pitch_deg,
                roll_deg=lens.roll_deg)
        scale = width / estimate.width
        least, most = estimate.focal_interval_px
        return cls(
            origin=lens.origin, focal_px=focal_px, hfov_deg=hfov_deg,
            straightness=estimate.straightness, offset=estimate.column_px / estimate.width,
            pitch_deg=estimate.pitch_deg, roll_deg=estimate.roll_deg,
            interval_px=(least * scale, most * scale),
            probability=estimate.probability, turns=estimate.turns)

    @property
    def settled(self) -> bool:
        """Return whether the focal length is known well enough to count quarter turns."""
        if self.origin is LensOrigin.ASSUMED:
            return False
        return self.interval_px is None or self.interval_px[1] < _WIDEST * self.interval_px[0]

    @property
    def most_angle(self) -> float:
        """Return by which factor true angles may be larger than those measured with it."""
        if self.origin is LensOrigin.ASSUMED:
            return _FAR_OFF
        return 1.0 if self.interval_px is None else self.focal_px / self.interval_px[0]

    def __str__(self) -> str:
        """Return the camera in words, for people."""
        focal = f'focal length {self.focal_px:.4g} px'
        if self.origin is LensOrigin.CALIBRATION:
            return f'{focal}, from the calibration'
        seen = f'field of view {self.hfov_deg:.0f} degrees, {focal}'
        if self.origin is LensOrigin.GIVEN:
            return f'{seen}, from the parameters'
        if self.interval_px is None:
            return f'{seen}, assumed until a turn determines it'
        least, most = self.interval_px
        turns = '1 part of a turn' if self.turns == 1 else f'{self.turns} parts of turns'
        return (
            f'{seen} (90 % interval: {least:.4g} to {most:.4g}), learned from {turns}; pitch'
            f' {abs(self.pitch_deg):.0f} degrees {"down" if self.pitch_deg >= 0 else "up"}')
