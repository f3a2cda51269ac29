# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera that a drive is measured with: what it was taken for, from where, how sure."""

from dataclasses import dataclass

from phase_traj_ros.core.camera.lens import Lens, LensOrigin


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
    straightness: float
    """Of the lens: 1 for a pinhole, 0 for an equidistant fisheye."""
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

    def __str__(self) -> str:
        """Return the camera in words, for people."""
        seen = f'{self.hfov_deg:.0f} degrees across, focal length {self.focal_px:.4g} px'
        if self.origin is LensOrigin.GIVEN:
            return f'{seen}, as the parameters say'
        if self.origin is LensOrigin.CALIBRATION:
            return f'focal length {self.focal_px:.4g} px, from its calibration'
        if self.interval_px is None:
            return f'{seen}: assumed, as no turn has told it'
        least, most = self.interval_px
        turns = f'{self.turns} turn{"" if self.turns == 1 else "s"}'
        return (
            f'{seen} (90 % sure of {least:.4g} to {most:.4g}), learned from {turns}; it looks'
            f' {abs(self.pitch_deg):.0f} degrees {"down" if self.pitch_deg >= 0 else "up"}')
