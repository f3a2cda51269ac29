# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the distance, in physical units."""

from dataclasses import dataclass
import math


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadTuning:
    """
    Tuning of the distance; not for users.

    Lengths are in camera heights. Where no source is given, the value was chosen on the drives of
    docs/measurements/distance.md and docs/measurements/frame_rate.md.
    """

    half_width: float = 2.1
    """Half the width of a patch: a lane and parts of its neighbours."""
    interpolation_blur: float = 1 / math.sqrt(3)
    """Blur along the road, by the linear interpolation between two rows in both of two pictures:
    its standard deviation as a share of the distance of the rows."""
    max_row_spacing: float = 0.3
    """A patch ends where an image row covers more than this..."""
    patch_end: float = 10.0
    """...at most at this distance..."""
    patch_begin: float = 1.5
    """...and begins here: nearer, cameras with a wide view see the shadow of the vehicle."""
    near_ends: float = 0.55
    """End of the near patch, and..."""
    far_begins: float = 0.2
    """...start of the far patch, as fractions of the visible stretch..."""
    min_length: float = 1.0
    """...which has at least this length, and..."""
    min_rows: float = 20.0
    """...so many image rows: with 10 to 20, rendered distances were up to 29 % short."""
    min_seen: float = 0.3
    """Least visible share of a patch."""
    mean_cells: float = 8.0
    """Standard deviations, in cells, of the filters for the mean of the asphalt..."""
    contrast_cells: float = 12.0
    """...and for its contrast."""
    noise_levels: float = 2.0
    """Contrast of the sensor noise, in grey levels."""

    least_offset: float = 0.3
    """Road that slides by more than this fraction of the length of the near patch is compared with
    the stretch from which it comes..."""
    max_offset: float = 3.0
    """...at most this far ahead of the patch."""
    offset_error: float = 0.04
    """Error of the ratio of two such slides. Without it, the pitch follows them too closely, and
    the distances of rendered motorways were up to 3 % longer."""
    lateral_cells: int = 4
    """Lateral search range in cells: the motion is not exactly straight, and a camera ahead of the
    rear axle moves sideways in a turn."""
    longest_slide: float = 0.7
    """Largest slide, as a fraction of the length of a patch."""
    min_overlap: float = 0.05
    """Least overlap of two patches by which the map is divided: beyond, it is noise."""
    peak_half_width: int = 3
    """Width of a peak to each side."""
    min_score: float = 7.0
    """Significance of a peak, in standard deviations: among a thousand positions, noise does not
    reach it."""
    clear_score: float = 10.0
    """Where all patches in view show a slide, with one peak above this, it is not noise. In
    compressed films, noise that lasts for half a second has had peaks of up to 9."""
    peak_cells: float = 0.3
    """Standard deviation of the position of a peak, in cells."""
    slide_gate: float = 4.0
    """Two slides disagree if they differ by this many standard deviations."""

    fixed_cells: float = 1.0
    """What slides by less than this may be fixed to the camera, or the vehicle stands."""
    passing: float = 0.004
    """The vehicle moves if the ratio of translation to distance of near blocks exceeds this: it is
    0.002 at most where it stands..."""
    driving: float = 0.02
    """...and above this, the road has slid by more than ``fixed_cells``..."""
    min_block_distance: float = 1.8
    """...as the blocks are at least this far away: the road 15 degrees down is at 3.7, and house
    fronts of narrow streets were at 2.0."""
    learning_slide: float = 0.2
    """The mean pattern is updated when the road has slid by this."""
    pattern_patches: int = 20
    """Patches over which the mean of the pattern is taken, and..."""
    min_patches: int = 3
    """...the least number of them."""
    relearned_patches: int = 8
    """Patches that are made again learn from this number of keyframes, and from no fewer: with 5,
    the road did not average out, and starts after a stop were up to 0.45 short."""
    driving_yaw_rate: float = math.radians(3.0)
    """A vehicle that turns at less than this, in rad/s, may stand."""

    baseline: float = 0.75
    """A keyframe is replaced before the road slides by this, ..."""
    max_rotation: float = 0.06
    """...when the camera has turned by this, in rad, ..."""
    max_keyframe_age: float = 0.5
    """...or after this time in seconds."""
    standing_time: float = 0.3
    """The vehicle stands if the road has not slid for this time in seconds; from then on..."""
    creep_time: float = 2.0
    """...the keyframe is kept for this time, to detect a creeping vehicle."""

    resting_coherence: float = 0.4
    """A road rests if more than this share of the spectrum of the near patch stays in place. While
    a road moved, it was below 0.35 in 99 % of the pairs of real films."""
    resting_agreement: float = 0.7
    """An encoder lowers the coherence. A road also rests where its slide is 0 and more than this
    share of the blocks agree that nothing moves: of 400 drops, fewer did in turns."""
    creeping: float = 0.025
    """A scene that moves by less between keyframes, as ``passing``, is not close traffic: that of
    slow vehicles was 0.022 at most where an encoder copied the road, and traffic 0.029 or more."""
    thumbnail_px: tuple[int, int] = 24, 16
    """Width and height to which frames are reduced..."""
    thinned_px: int = 64
    """...after they are thinned to about this height, ..."""
    recall_time: float = 8.0
    """...to compare the view with that of up to this time in seconds before, ..."""
    recall_yaw: float = 0.05
    """...if the camera has turned by less than this since, in rad, ..."""
    same_scene: float = 0.2
    """...and least correlation of the two in the same scene. It was 0.69 or more where rendered
    robots stopped hard, and 0.06 or less where something had come over the view."""

    block_pitch_deviation: float = 0.0006
    """Standard deviation of the pitch from the blocks between two frames, in rad."""
    unmeasured_pitch_deviation: float = 0.0025
    """The same if the blocks do not measure it: the motion of the suspension."""
    grade_time: float = 2.0
    """Time constant in seconds after which a continuing pitch is attributed to the road."""
    max_pitch_deviation: float = 0.03
    """Largest deviation of the pitch, in rad, with which the distance is measured..."""
    max_pitch_error: float = 0.006
    """...and largest error of the pitch before the patches are made again, ..."""
    max_azimuth_error: float = math.radians(2.0)
    """...and of their azimuth: it shortens the distance by 0.06 %."""
    min_lean: float = math.radians(1.0)
    """Least roll relative to that of the patches that is removed from them."""
    min_slide: float = 0.1
    """Least slide of a pair for the estimation of the pitch."""

    profile_step: float = 0.25
    """Step of the speeds of a profile, in camera heights per second."""
    profile_begins: float = 0.3
    """Least slide of a profile: the side lobes of fixed patterns end there."""
    profile_s: float = 0.5
    """Time constant in seconds over which it is averaged, ..."""
    profile_intervals: float = 5.0
    """...or in intervals, if that is longer: as many pairs below 10 Hz as at 10 Hz, ..."""
    profile_pairs: float = 4.0
    """...from this number of pairs on."""
    profile_share: float = 0.8
    """A speed counts if it was in range in this share of the pairs."""
    profile_score: float = 6.0
    """Least height of its peak above the median, in standard deviations of one pair, divided by
    the root of the number of pairs..."""
    profile_newest: float = 2.0
    """...in the mean, and this in the newest pair..."""
    profile_ratio: float = 1.4
    """...and above the next highest, ..."""
    profile_width: float = 0.15
    """...which is farther from it than this share of the speed."""
    profile_alone_s: float = 0.15
    """With longer intervals, the blocks have to agree, too: else the frames may have so little in
    common that the next marking of the road looks like this one."""
    doubtful_deviation: float = 1.0
    """Least deviation of a speed in doubt: a profile may replace it, and every frame counts."""

    acceleration: float = 2.0
    """Acceleration of a vehicle in camera heights per second squared (3.3 m/s2 at 1.65 m)."""
    gate: float = 3.0
    """Search range of the speed, in standard deviations: three times the acceleration is the limit
    of tyres."""
    max_speed: float = 45.0
    """Largest speed in camera heights per second, forward and in reverse, ..."""
    max_unseen_reverse_speed: float = 1.5
    """...and that in reverse where the blocks do not show it: what recedes may be traffic."""
    unknown_speed_deviation: float = 10.0
    """Standard deviation of an unknown speed."""
    lens_change_error: float = 0.3
    """Error of the speed after the lens was replaced, as a fraction of the speed."""
    confirmation_time: float = 0.5
    """A first speed that no second one confirms within this time in seconds is discarded."""
    max_bridged_time: float = 2.5
    """Longest time, in seconds, for which the last speed bridges a gap."""
    max_foreseen_slide: float = 1.0
    """Longest slide of the road between measured frames: the patches end about 10 ahead, and the
    texture that remains in view changes its size."""

    min_calibration_speed: float = 2.0
    """Least speed, in camera heights per second, at which the height is estimated."""
    given_speed_error: float = 0.05
    """Standard deviation of a given speed, as a fraction of it."""
    against_share: float = 0.25
    """The road contradicts a given speed if it slides the other way by more than this share..."""
    against_speed: float = 0.1
    """...of more than this speed..."""
    speed_delay_ns: int = 1_200_000_000
    """...for longer than this time: speeds come late, or once per second."""


TUNING = RoadTuning()
