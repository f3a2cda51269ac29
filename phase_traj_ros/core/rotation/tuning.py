# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the yaw, in physical units."""

from dataclasses import dataclass
import math


@dataclass(frozen=True, slots=True, kw_only=True)
class YawTuning:
    """
    Tuning of the measurement of the yaw; not for users.

    Angles are in radians, times in seconds, pixels are those of the cylinder. Where no source is
    given, the value was chosen on the drives of docs/measurements/heading.md and frame_rate.md.
    """

    # Blocks: least squares on a pyramid (Lucas and Kanade, 1981; Bouguet, 2001).
    blocks: tuple[int, int] = 8, 20
    """Rows and columns of blocks..."""
    block_px: int = 11
    """...and the side of a block. With 9, noisy and compressed pictures turn the heading by a
    quarter more, and clear ones by a tenth."""
    pyramid_levels: int = 4
    """Halvings of the picture, with which a block is searched within about 60 pixels."""
    search_steps: int = 20
    """Most steps of the search per level..."""
    search_px: float = 0.003
    """...which ends with a shorter step than this. After 0.03, the start value still showed: a
    bend of 20 degrees at 60 Hz was 0.3 degrees short."""
    min_texture: float = 1e-5
    """Smaller eigenvalue of the gradient matrix of a block (per pixel, as scaled by OpenCV) up to
    which it is not searched: that of a slope by a tenth of a grey value per pixel."""
    full_texture: float = 3.0
    """Smaller eigenvalue per pixel, in squares of grey values, from which the weight of a block is
    1."""
    min_corner: float = 0.1
    """Least ratio of the smaller to the larger eigenvalue. Below it, a block shows only an edge,
    and its motion along the edge is invisible: in a bend, the kerb does not move in the image."""
    min_texture_share: float = 0.3
    """Least share of the texture of a block that is not taken for noise. With 0, no block counts
    after a frame with much motion blur: the heading turned several times as far. With 0.1, the
    heading errs by half more at night."""
    block_deviation_px: float = 0.25
    """Standard deviation of the displacement of a block without noise."""
    fixed_px: float = 0.4
    """A block that moves by less while the scene must move may be fixed to the camera..."""
    moving_px: float = 1.4
    """...and one that moves by more is not."""
    fixing_rate: float = 0.15
    """Share of the doubt that remains by which a block becomes fixed with each such pair..."""
    releasing_factor: float = 0.7
    """...and factor by which it is kept so with each pair in which it moves."""
    min_image_shift_px: float = 1.7
    """The scene moves in all blocks if the image turns by more..."""
    min_road_shift_px: float = 2.8
    """...and in the blocks on the road if half of all blocks move by more."""
    resting_share: float = 0.2
    """Traffic close in front of a standing vehicle looks like a turn, but at least this share of
    the blocks rests at first, ..."""
    turning_passing: float = 0.25
    """...and the median of the translation divided by the distance of the blocks is less than this
    share of the yaw: in a turn of 6 m radius, half of the scene would be beyond 24 m."""
    entering_share: float = 0.2
    """Before, it has entered the image: more than this share of the blocks moved, ..."""
    free_share: float = 0.5
    """...and it has passed when this share of them rests again."""
    road_slope: float = 0.1
    """Slope below which a block shows the road: 6 degrees down, about 15 m ahead of a car."""

    # The fit of the motion.
    fit_steps: int = 4
    """Steps of the Gauss-Newton method, ..."""
    slope_steps: int = 2
    """...and further ones for the slope of the direction of travel, with weights that fall faster:
    without them, distances are 0.2 % longer by day, and a fifth of their excess at night."""
    inverse_depth_deviation: float = 0.1
    """Prior standard deviation of the translation divided by the distance of a block."""
    outlier_deviations: float = 3.0
    """A block that differs from the motion by more standard deviations does not agree with it."""
    min_score_slope: float = 0.5
    """Least derivative of the scores, relative to their weights, for the variance of the yaw: that
    of normal errors of the expected size. Larger ones are those of the model, near by."""
    restart_share: float = 0.8
    """Unless this share of the blocks agrees, the fit starts again from those ahead: traffic
    beside a fast vehicle moves as the distance would in a turn."""
    ahead_size: tuple[float, float] = 0.12, 0.06
    """Half the width and height of what is ahead, around the direction of travel."""
    min_blocks: float = 10.0
    """Sum of the weights of the blocks that have to agree on a motion..."""
    min_agreement: float = 0.3
    """...and their share of all. For unrelated frames it is 0.06, at most 0.32."""
    confirmed_share: float = 0.15
    """...or this share, if the shift of the whole image confirms it. With less, or fewer blocks,
    only the shift counts."""
    confirmation_tolerance: float = 0.1
    """Share of the yaw by which the two may differ, if it is more than their deviations."""
    doubted_share: float = 0.5
    """With a smaller share, the start value is doubted, and others are tried."""
    common_error: float = math.radians(0.01)
    """Standard deviation of the error of the yaw that all blocks have in common: this..."""
    common_error_px: float = 0.06
    """...or this share of a pixel, whichever is more. With fewer than 340 pixels per radian, it is
    the share of a pixel."""

    # The direction of travel, and the mounting of the camera.
    course_deviation: float = math.radians(1.0)
    """Standard deviation of the azimuth of the direction of travel about the mounting..."""
    course_time_s: float = 1.0
    """...its correlation time, in which the slope is forgotten, too, ..."""
    slope_deviation: float = math.radians(2.0)
    """...and the standard deviation of the slope."""
    mounting_deviation: float = math.radians(3.0)
    """Standard deviation of the azimuth at which cameras are mounted."""
    sideslip_s: float = 0.4
    """Sideslip of the camera per yaw rate: in a turn, a camera ahead of the rear axle moves
    sideways by the yaw rate times its lever arm. The quotient is 1.6 m at 4 m/s."""
    course_deviations: float = 2.0
    """Standard deviations of course and sideslip within which the course of blocks that hardly
    agree has to be."""
    slope_error_s: float = 0.1
    """Time in seconds in which the error of an unknown slope turns into an independent lean. With
    0.3, an unknown slope shows less in the roll, and the shaking of a car more."""
    yaw_rate_s: float = 0.25
    """Time constant of the mean of the yaw rate: a camera that shakes does not turn."""
    straight_yaw_rate: float = math.radians(3.0)
    """A vehicle drives straight ahead below this yaw rate..."""
    min_passing: float = 0.01
    """...and moves above this median of the translation divided by the distance of the blocks."""

    # The roll of the camera.
    lean_deviation: float = math.radians(1.0)
    """Standard deviation of the lean of a vehicle..."""
    lean_time_s: float = 10.0
    """...which fades with this time constant on a straight."""
    unseen_lean: float = math.radians(10.0)
    """Standard deviation of a lean that was not seen for long, ..."""
    unseen_lean_s: float = 2.0
    """...and time constant in seconds with which the last one that was seen is forgotten."""
    max_bank: float = math.radians(6.0)
    """A vehicle that leans to the inside by more than roads are banked (10 %, and a car leans to
    the outside) is a two-wheeler, ..."""
    lean_deviations: float = 2.0
    """...by so many standard deviations of the lean more."""
    known_mounting: float = math.radians(2.0)
    """Standard deviation of the roll of a mounting that is known well enough to see a bank."""
    pitch_walk: float = math.radians(1.2)
    """Standard deviation of the change of the pitch within a second, other than by the turn of a
    camera with a roll: on KITTI, the roll from a turn of 90 degrees errs by this."""
    max_roll: float = math.radians(70.0)
    """Largest roll that is taken for one."""

    # The pitch of the camera relative to the road.
    suspension_pitch: float = math.radians(0.5)
    """Pitch of the suspension, and of a road that bends: standard deviation in rad, and..."""
    suspension_time: float = 1.0
    """...correlation time in seconds."""
    common_pitch_error: float = 0.0015
    """Error of the measured pitch that does not average out, in rad: the road is not a plane, and
    the principal point has an error."""

    # The shift of the image as a whole, by phase correlation.
    shift_px_per_rad: float = 288.0
    """A picture with more pixels per radian is correlated at half its size."""
    max_shake_px: float = 20.0
    """Largest vertical shift between two frames."""
    shift_gate_px: float = 8.0
    """A shift that differs by more from the one that is foreseen is doubted."""
    zero_px: float = 1.5
    """A peak within this shift may be that of a pattern that is fixed to the camera, ..."""
    peak_distance_px: int = 4
    """...and another peak is farther from it than this."""
    min_significance: float = 8.0
    """Least significance of a shift that no blocks confirm..."""
    shift_deviation: float = math.radians(0.3)
    """...and the standard deviation of its yaw."""
    exposure_rate: float = 0.05
    """Share of a change of the brightness that the level follows with each frame."""

    # Keyframes (Leutenegger et al., "Keyframe-based visual-inertial odometry", 2015).
    baseline: float = 0.1
    """A keyframe is replaced before the median of the translation divided by the distance of the
    blocks exceeds this. From 0.03 to 0.15, the heading drifts less the longer it is, and fewer
    blocks agree: a fifth less at 0.1 than at 0.06 on a real drive of 560 m."""
    kept_agreement: float = 0.8
    """A frame is compared with the previous one instead if its agreement with the keyframe is less
    than this share of the largest so far. Noise lowers both: with a limit for the agreement
    itself, noisy pictures had no keyframes, and two to three times the drift at 30 and 60 Hz."""
    max_rotation: float = math.radians(4.0)
    """Rotation since a keyframe before which it is replaced, ..."""
    max_keyframe_age_s: float = 0.5
    """...and the longest time for which it is kept."""

    # Frames that are foreseen instead of measured.
    max_foreseen_s: float = 0.11
    """The next frame is measured within this time: 10 Hz are enough."""
    foreseen_tolerance_px: float = 0.5
    """Tolerance for an image that moves as foreseen."""
    scanline_px: int = 7
    """Columns over which the line of a picture is averaged: it may move by half of them beyond
    what is foreseen."""
    max_residual_share: float = 0.25
    """Share of the variance of a line that motion may leave unexplained: 0.18 at most on rendered
    drives at 14 m/s, 1 for unrelated images."""


TUNING = YawTuning()
