# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the search for areas fixed to the camera, in physical units."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedTuning:
    """
    Tuning of the search for fixed areas; not for users.

    Shares are from 0 to 1. The values were chosen on KITTI clips and rendered drives with bars,
    text, dirt and drops drawn on them.
    """

    # Samples of the drive.
    period_s: float = 0.35
    """Time between two samples: the scene changes meanwhile."""
    pixels: int = 14_000
    """A frame is reduced to about so many pixels, ..."""
    min_side: int = 8
    """...but no side to fewer than these."""
    brightness: float = 100.0
    """Mean to which a sample is scaled, in grey levels."""
    gradient_energy_share: float = 0.25
    """A gradient well above this share of the mean energy..."""
    noise_levels: float = 2.0
    """...and above this noise, in grey levels per pixel, is scaled to length 1; weaker ones are
    scaled to less."""
    noise_rows: int = 4
    """One in so many rows of a sample is compared with its neighbour, in the frame, to measure the
    noise."""
    staying_share: float = 0.5
    """Differences that change by less than this share between two samples are those of a
    pattern."""
    cell_share: float = 0.02
    """Side of a cell, as a share of the diagonal."""
    noise_share: float = 0.4
    """Averaged over cells, noise keeps less than this share of its contrast, a scene far more."""

    # Whether the world moves.
    moving_share: float = 0.25
    """The world moves if this share of the gradients changes, ..."""
    strips: int = 4
    """...in all but one of this many strips of rows, as one may be the bonnet; traffic fills only
    a few. A strip changes if..."""
    strip_change_share: float = 0.1
    """...this share of its gradients does, and is ignored with less than..."""
    min_strip_share: float = 0.1
    """...this share of all gradients."""
    zero_px: float = 0.75
    """A shift within this along the rows may be that of a fixed pattern."""
    standing_window_s: float = 2.0
    """Within this time, ..."""
    driving_share: float = 0.5
    """...a vehicle that drives, however slowly, changes more than this share of the image..."""
    standing_share: float = 0.1
    """...and a stationary one less than this."""

    # A straight road without much texture: only the horizon does not change.
    road_share: float = 0.35
    """Of the structure in this lowest part of the image, the road, ..."""
    road_unchanged_share: float = 0.5
    """...less than this share remains, ..."""
    far_unchanged_share: float = 0.25
    """...of that above more than this share, and of it..."""
    band_share: float = 0.55
    """...this share lies in a band of..."""
    bands: int = 6
    """...this part of the image's height."""

    min_passing: float = 0.005
    """A scene passes by if the median ratio of the translation to the distance of the blocks is
    above this; the noise of a fixed pattern is 0.002."""
    min_speed: float = 1.0
    """Where only fixed areas may agree, the yaw counts all the same if the road slides by faster
    than this, in heights of the camera per second, ..."""
    sliding_agreement: float = 0.7
    """...and this share of the blocks agrees on one motion: of 400 drops, fewer did in turns."""

    # The means of the gradients.
    sample_weight: float = 0.06
    """Largest weight of a sample in the means."""
    min_change: float = 0.2
    """Share of change around a cell from which on its gradients count..."""
    full_change: float = 0.6
    """...and from which on they count fully..."""
    change_radius_cells: int = 2
    """...within this radius."""
    full_shift_px: float = 4.0
    """With a larger shift between two samples, in their pixels, all gradients count fully."""

    # The areas.
    update_samples: int = 4
    """The areas are found again after so many samples, and..."""
    update_share: float = 0.005
    """...replaced if they differ in more than this share of the image."""
    neighbourhood_share: float = 0.012
    """Half the side of the square over which gradients are compared, as a share of the
    diagonal."""
    fixed_energy_share: float = 0.1
    """A place is fixed if a larger share of the energy of its gradients remains..."""
    evidence_penalty: float = 0.08
    """...than this with an addition that is inverse to the evidence, ..."""
    min_evidence: float = 0.3
    """...of which there is at least this."""
    dark_levels: float = 25.0
    """Bars are darker than this, in grey levels of a sample, ..."""
    constant_levels: float = 8.0
    """...vary by less than this..."""
    forgetting_levels: float = 0.03
    """...and are forgotten by this per sample."""
    min_usable_share: float = 0.5
    """Share that has to remain of what is not black..."""
    min_usable_image: float = 0.1
    """...and of the whole image."""
    min_masked: float = 0.01
    """Smallest share of the image to mask out: smaller areas do no harm, and a mask costs time."""


TUNING = FixedTuning()
