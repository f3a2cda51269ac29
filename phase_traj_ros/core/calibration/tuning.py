# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the self-calibration, in physical units."""

from dataclasses import dataclass
import math


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationTuning:
    """
    Tuning of the self-calibration; not for users.

    Widths are those of the image, pixels those of the picture that is tracked, which is at most
    ``tracked_px`` wide. Where no source is given, the value was chosen on the drives of
    docs/measurements/any_camera.md.
    """

    # The prior over cameras.
    usual_focal: float = 0.65
    """Median focal length of cameras, in widths: 75 degrees..."""
    focal_spread: float = 0.5
    """...and the standard deviation of its logarithm."""
    pinhole_share: float = 0.7
    """Share of cameras without distortion, ..."""
    pinhole_deviation: float = 0.05
    """...the standard deviation of their straightness: with 0.1, focal lengths learned from seven
    real drives scattered by a sixth more, also where 10 or 20 % of distortion was added, ..."""
    fisheye_straightness: float = 0.3
    """...the mean straightness of the others..."""
    fisheye_deviation: float = 0.5
    """...and its standard deviation."""
    column_deviation: float = 0.05
    """Standard deviation of the column of the principal point, in widths, ..."""
    cropped_share: float = 0.02
    """...unless the images are cropped: the share of such cameras."""

    # Points that are tracked through a turn, by least squares (Lucas and Kanade, 1981).
    tracked_px: int = 640
    """Wider images are reduced by an integer factor to at most this width. With 480, focal lengths
    were up to 5 % worse on real drives, and scattered twice as much on rendered ones."""
    points: int = 130
    """Points in an image, ..."""
    kept_points: int = 100
    """...in a stretch, ..."""
    min_points: int = 30
    """...and at least in one."""
    corner_quality: float = 0.005
    """Least quality of a corner, as OpenCV has it, relative to the best (Shi and Tomasi, 1994)."""
    min_distance_px: int = 6
    """Least distance of two points..."""
    min_distance_share: float = 1 / 60
    """...also as a share of the width, ..."""
    border_px: int = 4
    """...and from the edge."""
    centre_px: int = 4
    """Reach of the window in which a point is moved to the centre of its gradients (Förstner and
    Gülch, 1987): without it, focal lengths were 0.7 % too short, and scattered by half more."""
    window_px: int = 13
    """Side of the window of a point..."""
    small_window_px: int = 9
    """...and that in images narrower than the next value."""
    small_px: int = 200
    pyramid_levels: int = 3
    search_steps: int = 20
    """Most steps of the search per level..."""
    search_px: float = 0.02
    """...which ends with a shorter step than this."""
    round_trip_px: float = 0.4
    """Largest error of a point that is tracked forward and back."""
    fixed_px: float = 0.5
    """A point that moves by less is fixed to the camera..."""
    moved_px: float = 3.0
    """...if the image moves by more than this: a bumper may have most of the texture."""
    min_tracked_share: float = 0.25
    """A stretch ends if a smaller share of the points can be tracked."""

    # Stretches of a turn.
    step: float = 0.05
    """Motion of the image in a step, in widths, ..."""
    stretch: float = 0.6
    """...in a stretch, ..."""
    min_stretch: float = 0.15
    """...and in the shortest usable one."""
    min_steps: int = 4
    max_steps: int = 20
    min_step_s: float = 0.29
    """A step also ends after this, three intervals at 10 Hz, less the tolerance of their stamps,
    ..."""
    min_parallax: float = 0.02
    """...once a quarter of the points has moved farther than this from where the motion of the
    image takes them, in widths: a slow vehicle needs longer than a car."""
    max_tracking_interval_s: float = 0.09
    """Longest time between two searches of the points: an interval at 10 Hz, less the tolerance
    of its stamps."""
    min_turn_speed: float = 0.01
    """Least mean speed of the image in a turn, in widths per second, ..."""
    ended_share: float = 0.1
    """...also as a share of the largest one of the stretch, which starts if..."""
    slow_turn_s: float = 1.0
    """...it lasts for so long, or..."""
    clear_turn_speed: float = 0.025
    """...is faster than this, ..."""
    turn_speed_time_s: float = 0.4
    """...and the time constant of that mean."""
    max_frame_motion: float = 0.35
    """Largest motion of the image between two frames, in widths."""

    # The fit of a stretch. The mean translation between two of its frames has the length 1.
    point_deviation_px: float = 0.3
    """Standard deviation of a tracked point."""
    speed_deviation: float = 0.3
    """Standard deviations of the motion between frames: along the viewing direction, ..."""
    sideways_deviation: float = 0.15
    """...to the side and up, ..."""
    shake_deviation: float = math.radians(1.5)
    """...and of the rotation about the other axes."""
    common_factor: float = 2.0
    """Deviation of what is common to all frames of the stretch, relative to these two:
    sideslip of a camera ahead of the rear axle, and a pitched or rolled mounting."""
    inverse_depth_deviation: float = 0.3
    """Prior standard deviation of the inverse depth of a point..."""
    start_inverse_depth: float = 0.03
    """...and its start value."""
    max_duration_ratio: float = 2.0
    """The speed is taken as constant in steps whose duration is within this factor of the median;
    the distance in shorter and longer ones is that of the limit."""
    positive_depth_weight: float = 1e4
    """Weight of the constraint that points are in front of the camera..."""
    min_inverse_depth: float = -1e-3
    """...and the least inverse depth."""
    prior_straightness: float = 0.7
    """Prior of the straightness in a fit..."""
    straightness_deviation: float = 0.6
    """...and its standard deviation."""
    guesses: tuple[tuple[float, float, float], ...] = (
        (0.23, 1.0, 0.0), (0.45, 0.6, 0.0), (0.9, 0.9, 0.0), (2.2, 1.0, 0.0))
    """Start values: focal length in widths, straightness, and column in widths..."""
    cropped_guesses: tuple[tuple[float, float, float], ...] = ((0.9, 0.9, -0.45), (0.9, 0.9, 0.45))
    """...and those for cropped images, which are tried if none of the others fits well."""
    first_steps: int = 5
    """Steps of the Levenberg-Marquardt method from each of several start values, ..."""
    fit_steps: int = 14
    """...from the best one..."""
    damping_tries: int = 6
    """...and values of the damping that are tried in each, ..."""
    first_damping: float = 1e-5
    """...the first one..."""
    min_damping: float = 1e-6
    """...and the least: with more, the valleys of narrow lenses count as settled."""
    max_focal_step: float = 0.4
    """Largest change of the log focal length in a step..."""
    max_straightness_step: float = 0.5
    """...and of the straightness."""
    converged_focal: float = 1e-3
    """A fit is settled when the log focal length changes by less, ..."""
    converged_straightness: float = 5e-3
    """...the straightness by less, ..."""
    min_gain: float = 1e-2
    """...and the cost by less than this share."""
    derivative_step: float = 1e-4
    """Difference of the lens for its numerical derivatives."""

    # The acceptance and the weight of a fit.
    known_focal_deviation: float = 0.08
    """Deviation of the log focal length below which a fit starts at the estimate..."""
    good_cost: float = 2.5
    """...and largest cost per observation to accept that fit; 1 or 2 for a static scene."""
    given_cost: float = 2.0
    """A fit that starts at the given lens and costs more may have stayed at a wrong one."""
    max_cost: float = 3.0
    """Largest cost per observation of a usable fit..."""
    min_static: float = 0.65
    """...to which this share of the points has to belong; others may be on moving vehicles: in
    corners with a van and a cyclist 0.74 or more, in a bend of a motorway, whose fit was 66 % off,
    0.5."""
    max_deviation: float = 0.12
    """Largest deviation of the log focal length of a usable fit."""
    other_focal: float = 0.35
    """Difference of the log focal length from which two lenses are different ones..."""
    other_cost: float = 1.04
    """...a fit is ambiguous if one costs less than this factor times the best: 1.03 at most in
    rendered bends at 1.5 deg/s, whose fits were 60 to 83 % off, and 1.07 or more in corners..."""
    hopeless_cost: float = 2.0
    """...and one that costs more than this factor after the first steps is not optimised further:
    in 46 ambiguous fits it was 1.7 at most, in most corners it is more than 2.2."""
    deviation_factor: float = 2.5
    """Factor of the deviations of a fit, ..."""
    focal_error: float = 0.03
    """...and what is added to that of the log focal length, ..."""
    straightness_error: float = 0.05
    """...of the straightness, ..."""
    column_error: float = 0.015
    """...and of the column, in widths."""
    given_focal_deviation: float = 0.01
    """Standard deviation of the logarithm of a given focal length, ..."""
    given_straightness_deviation: float = 0.03
    """...of a given straightness, ..."""
    given_column_deviation: float = 0.015
    """...and of the column of the principal point of such a lens, in widths: those of KITTI are
    0.010 off the centre..."""
    given_column_error: float = 0.003
    """...with this error of each fit, ..."""
    given_gate: float = 2.5
    """...a larger one beyond these standard deviations, ..."""
    known_column: float = 0.003
    """...until the column is known to this deviation, in widths."""
    contradiction_deviations: float = 2.0
    """Half of the fits have to be off by more standard deviations than this to contradict a given
    lens (fisheyes that were given as pinholes were off by 12 to 18), ..."""
    judging_yaw_rate: float = math.radians(7.0)
    """...of turns with a faster mean yaw rate than this, as seen with the given lens. Of 377
    drives with the right one, none contradicted it; with slower bends, whose fits were 34 to 65 %
    too short, 14 did."""
    degrees_of_freedom: float = 4.0
    """Degrees of freedom of Student's distribution, as large errors are not rare."""
    free_fits: int = 4
    """After so many fits, the n-th further one waits..."""
    fit_spacing_frames: int = 40
    """...for so many frames times n squared: many turns add little."""
    axis_error: float = math.radians(1.2)
    """Change of pitch and roll of a vehicle between the ends of a turn, in radians. The smaller
    the turn, the larger is its effect on the axis."""


TUNING = CalibrationTuning()
