# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The tuning of the preparation of frames, in physical units."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class FramesTuning:
    """
    Tuning of the preparation of a frame; not for users.

    The values for repeated pictures were chosen on videos of KITTI 00 and 06 and of a rendered
    robot, by x264 (crf 20 to 40, 1 Mbit/s), MPEG-4, VP9 and MJPEG.
    """

    mean: float = 100.0
    """Mean of a prepared frame of more than 8 bits, in grey levels, ..."""
    contrast: float = 50.0
    """...and its standard deviation: those of a street by day. Two deviations are left below the
    mean, and three above."""

    same_time_ns: int = 2_000_000
    """Two frames that are nearer in time are one exposure: no camera is as fast."""
    reencoded_median: float = 0.3
    """A thorough encoder improves a picture that it repeats: half of the squares change by less
    than this, in grey levels, ..."""
    reencoded_max: float = 10.0
    """...and the others by no more than this. A vehicle in KITTI changes them by 20 and 110, and
    the noise of a sensor changes all of them alike."""
    frozen_max: float = 0.6
    """After ``halt_ns``, a vehicle may stand or creep, and an encoder may have removed the noise
    of the sensor. A frame is then new unless all squares stay within this: sensors have a noise of
    a grey level or more."""

    square_px: int = 16
    """Side of the squares that are compared, in pixels."""
    halt_ns: int = 250_000_000
    """Time in which a vehicle does not stop and start again."""
    halt_share: float = 0.4
    """A picture that halts changes by less than this share of what it changed by in motion."""
    still_px: float = 0.2
    """Half of the squares with the most texture move by less in a picture that halts, reduced to
    about ``still_width_px``, ..."""
    still_max_px: float = 0.6
    """...and 90 % by less than this. Encoders reach 0.19 and 0.6 (H.264 up to crf 32, MPEG-4,
    VP9), KITTI at 10 Hz 1 or more, a robot at walking pace and 60 Hz 0.2 and 0.7."""
    still_width_px: int = 480
    repeat_memory_frames: int = 20
    """Frames for which a video that repeated a picture is expected to do so again."""

    jitter_intervals: int = 15
    """Newest intervals from which the jitter of the stamps is estimated, ..."""
    fewest_intervals: int = 3
    """...and the fewest from which it can be."""
    jump_ns: int = 1_000_000_000
    """A jump of the stamps of more than this is doubtful until the next stamp confirms it. Below
    it are swapped neighbours and the steps of a clock that NTP corrects; a gap in a recording is
    usually longer."""
    jump_intervals: int = 2
    """A forward jump within this multiple of the median of the last three intervals is the frame
    rate of a slow stream."""
    clock_set_ns: int = 86_400_000_000_000
    """A larger jump after the first frame is due to a clock that was not set before, as no
    recording pauses for so long."""


TUNING = FramesTuning()
