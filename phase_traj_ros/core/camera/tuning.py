# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the camera and of its projection, in physical units."""

from dataclasses import dataclass
import math


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraTuning:
    """
    Tuning of the camera and of its projection; not for users.

    Angles are in radians, except where a name ends with ``_deg``.
    """

    # The projection onto the cylinder.
    above_deg: float = 20.0
    """Extent of the band above the optical axis: higher are the sky and the tops of near
    buildings, ..."""
    below_deg: float = 15.0
    """...below it: lower, the road passes too fast, and the bonnet does not move, ..."""
    side_deg: float = 60.0
    """...and to either side."""
    usual_px_per_rad: float = 330.0
    """A camera is reduced by the whole number that comes nearest to this many pixels per radian,
    ..."""
    min_columns: int = 360
    """...and a tele camera keeps at least about this many columns:
    docs/measurements/heading.md."""
    scanline_row_step: int = 4
    """Every so many rows of the cylinder are averaged to its scanline."""
    search_grid: tuple[int, int] = 65, 241
    """Slopes and azimuths in which a distorted image is searched, ..."""
    search_steps: int = 4001
    """...and directions along each of the two lines to its edges: 0.03 degrees are less than a
    tenth of a pixel."""

    # A calibrated camera.
    range_rays: int = 72
    """Rays from the optical axis on which the range of a model is searched, ..."""
    range_steps: int = 500
    """...and steps of 0.18 degrees on each ray, up to 90 degrees."""
    hfov_steps: int = 1800
    """Steps of a tenth of a degree for the field of view."""
    pinhole_tolerance: float = 0.02
    """Below this difference of the straightness from a pinhole, distortion has no effect on the
    yaw."""
    same_focal: float = 0.001
    """Tolerances for calibrations that vary with the autofocus: relative focal length, ..."""
    same_centre_px: float = 0.25
    """...and principal point."""

    # The lens in use.
    assumed_deviation: float = 0.3
    """Relative standard deviation of the focal length of an unknown camera, ..."""
    max_assumed_ratio: float = 2.0
    """...and factor by which its angles may be too small: a fisheye of 180 degrees. With 1.5,
    slow corners of 90 degrees that a camera of 130 degrees never saw as turns were reliable."""
    same_lens: float = 0.01
    """Lenses are equal if their focal lengths (relative), offsets (in widths) and tilts (cosine)
    differ by less than this, ..."""
    same_offset: float = 0.002
    """...the offsets of given lenses by less than this, ..."""
    same_straightness: float = 0.05
    """...and their straightnesses by less than this."""
    max_focal_ratio: float = 1.5
    """Largest ratio of the limits of the focal length with which quarter turns can be counted."""

    # A camera that is learned from drives.
    common_error: float = 0.02
    """Relative error of the focal length, and error of the straightness, that is common to all
    drives of a camera: the principal point is not exactly at the centre, and the lens is not
    exactly of the family."""
    pitch_deviation: float = math.radians(8.0)
    """Prior standard deviation of the pitch, as most cameras are mounted nearly level, ..."""
    roll_deviation: float = math.radians(3.0)
    """...and of the roll."""
    given_tilt: float = math.radians(1.0)
    """Standard deviation of a pitch or roll that a user or a description of the vehicle gives."""
    turn_pitch: float = math.radians(1.0)
    """Standard deviations of the axis of a turn from the vertical, as vehicles and roads lean: in
    pitch, ..."""
    turn_roll: float = math.radians(2.0)
    """...and in roll."""
    mounting_drift: float = math.radians(0.3)
    """Standard deviation of the change of an angle of the mounting with the load..."""
    mounting_drift_s: float = 600.0
    """...within this time in seconds."""
    outlier_deviations: float = 2.0
    """The weight of a pitch or roll decreases beyond this many standard deviations."""

    # Its height.
    usual_height: float = 1.5
    """Prior of an unknown camera height in metres, and..."""
    height_spread: float = 0.5
    """...its relative standard deviation."""
    speedometer_error: float = 0.02
    """Least relative deviation of a height from given speeds: the error of a speedometer."""
    lens_height_error: float = 0.15
    """Relative deviation of such a height after another lens was learned, times the change of the
    log focal length and of the straightness: on rendered drives it was 0.06 at most for pinholes,
    and 0.17 to 0.25 for fisheyes."""
    height_pair_error: float = 0.1
    """Relative deviation between the two distances of a pair, and..."""
    height_pair_time: float = 1.0
    """...the time in seconds for which it is correlated."""


TUNING = CameraTuning()
