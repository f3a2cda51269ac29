# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the heading, in physical units."""

from dataclasses import dataclass
import math


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadingTuning:
    """
    Tuning of the heading and the turns; not for users.

    Angles are in radians, times in seconds. Where no source is given, the value was chosen on the
    drives of docs/measurements/heading.md and frame_rate.md.
    """

    # The heading, where the yaw is not measured.
    max_acceleration: float = math.radians(300.0)
    """A faster change of the yaw rate is rejected until the next pair confirms it, ..."""
    rate_error: float = math.radians(5.0)
    """...in addition to the error of the rate, ..."""
    gate_deviations: float = 3.0
    """...unless it is within these standard deviations of what the vehicle has done before..."""
    process_s: float = 20.0
    """...with this time constant..."""
    min_rate_time_s: float = 0.04
    """...by its rates over at least this time. 1,300 degrees per second squared are common on a
    model car, ..."""
    max_rate_change: float = math.radians(130.0)
    """...but larger changes of the rate, mostly due to traffic, count as this."""
    rate_fading_s: float = 1.0
    """Time constant with which the yaw rate fades while nothing is measured..."""
    bridged_deviation: float = math.radians(5.0)
    """...and the standard deviation of the yaw rate meanwhile, without the process noise."""

    # Cuts of an edited video.
    cut_share: float = 0.25
    """Across a cut, less of the blocks agree than this share of those that agree beside it."""
    lost_intervals: float = 1.5
    """An interval of more than this many previous ones has lost frames, and is not a cut."""

    # Bends and turns, in degrees, and in heights of the camera.
    turn_deg: float = 60.0
    """Least angle of a turn."""
    quarter_error_deg: float = 45.0
    """With a larger error of its angle, the number of quarter turns of a turn is not known."""
    min_bend_rate_deg: float = 0.05
    """Change of the heading per height in the gentlest bend: a radius of 1.9 km with a camera at
    1.65 m. Straight roads, and the drift of the heading on them, are well below."""
    dip_deg: float = 10.0
    """A dip is shorter than the distance in which the bend turns by this angle, ..."""
    min_dip: float = 2.5
    """...but not shorter than these heights, as there is more than 4 m of straight road between
    two corners, ..."""
    max_dip: float = 30.0
    """...nor longer than these."""
    dip_end_deg: float = 1.0
    """Change to the side of the bend that ends a dip; the heading on a straight varies by less."""
    swerve_deg: float = 5.0
    """A bend of less is a swerve: the vehicle drives straight on."""
    usual_speed: float = 5.0
    """Heights per second if the distance is unknown: a car at 30 km/h..."""
    min_speed: float = 0.02
    """...and at least, as a turn ends some time after a stop."""
    kept_bends: int = 20
    """Bends that are kept, in case all headings are corrected by a factor later."""
    contradiction_deviations: float = 2.0
    """Standard deviations of the heading by which the direction has to differ to contradict."""


TUNING = HeadingTuning()
