# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The parameters, declared once for the node, the command line and the docs.

This module does not use rclpy. ``phase_traj_ros.ros.declare`` declares the table on a node, and
``phase_traj_ros.io.params_file`` reads the values from a ROS parameter file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, MISSING, replace
from difflib import get_close_matches
from enum import Enum
from functools import cache, cached_property
from typing import Any, cast

from phase_traj_ros.core import EstimatorSettings, PAPER_THRESHOLD, View, Window
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.camera.lens_family import PINHOLE, STRAIGHTNESS_RANGE
from phase_traj_ros.core.camera.projection import LEAST_HFOV_DEG
from phase_traj_ros.core.codes.links import LEAST_STEP
from phase_traj_ros.core.correlation.quality import GateSettings, StillnessSettings
from phase_traj_ros.core.correlation.transforms import TransformLibrary
from phase_traj_ros.core.path.speed import MOST_SPEED
from phase_traj_ros.core.path.way import LengthUnit
from phase_traj_ros.core.settings import CodeSource, PathSource
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.parameter_spec import Group, NOT_NEGATIVE, parameter, POSITIVE, Spec

NODE_NAME = 'phase_traj'

# Frames of REP 105 for a pose in metres, and of this package for others.
_ODOM, _UNSCALED = 'odom', NODE_NAME
# Ten seconds at a thousand speeds a second.
_MAX_SPEEDS = 10_000


class Transport(Enum):
    """Transport of the images."""

    RAW = 'raw'
    COMPRESSED = 'compressed'


class SpeedType(Enum):
    """Message type of the vehicle's speed."""

    TWIST = 'twist'
    TWIST_WITH_COVARIANCE = 'twist_with_covariance'
    ODOMETRY = 'odometry'


@dataclass(frozen=True, kw_only=True)
class Parameters:
    """
    One set of values for all parameters. The defaults work with any camera.

    Raises
    ------
    ParameterError
        A value is of the wrong type or out of its range.

    """

    image_transport: str = parameter(
        Transport.RAW.value, 'Images to subscribe to: raw images on image, or compressed images'
        ' on image/compressed.', choices=tuple(each.value for each in Transport),
        read_only=True, group=Group.VEHICLE)
    max_pixels: int = parameter(
        1 << 26, 'Compressed images with more pixels are rejected before they are decoded.',
        minimum=64, maximum=1 << 30, read_only=True)
    threshold: float = parameter(
        0.0, 'Horizontal shift between two frames from which a pair is a turn, as in the paper.'
        f' 0 leaves the choice to code_source; with code_source shift, 0 is {PAPER_THRESHOLD:g}.',
        unit='px/frame', group=Group.USER, **NOT_NEGATIVE)
    threshold_deg_s: float = parameter(
        0.0, 'Yaw rate from which a pair is a turn. It replaces threshold and is the same for all'
        ' cameras and frame rates. Requires a focal length. 0 uses threshold.',
        unit='deg/s', minimum=0.0, maximum=1000.0)
    code_source: str = parameter(
        CodeSource.AUTO.value, 'What the codes are made from: the turns of the measured heading'
        ' (auto; an unknown camera is learned from the drive), the shift and a threshold, as in'
        ' the paper (shift), or the quantised heading (heading; requires a focal length). If a'
        ' threshold is set, auto is shift.',
        choices=tuple(each.value for each in CodeSource), read_only=True, group=Group.VEHICLE)
    connectivity: int = parameter(
        4, 'Number of directions of the direction code: 4 as in the paper, or 8 (Freeman). 8'
        ' requires code_source heading.', minimum=4, maximum=8, step=4, read_only=True)
    focal_px: float = parameter(
        0.0, 'Focal length of the camera in pixels of the full image. The heading and the turns'
        ' are measured with it. 0 if unknown.', unit='px', minimum=0.0, maximum=1e6,
        read_only=True, group=Group.VEHICLE)
    hfov_deg: float = parameter(
        0.0, 'Horizontal field of view of the camera, used if focal_px is 0. If both are 0 and a'
        ' focal length is required, camera_info provides it.',
        unit='deg', minimum=0.0, maximum=179.0, read_only=True, group=Group.USER)
    lens_straightness: float = parameter(
        PINHOLE, 'Kind of lens, with focal_px or hfov_deg: 1 for a pinhole, 0 for an equidistant'
        ' fisheye. phase_traj calibrate measures it.', minimum=STRAIGHTNESS_RANGE[0],
        maximum=STRAIGHTNESS_RANGE[1], read_only=True)
    lens_offset: float = parameter(
        0.0, 'Offset of the principal point from the centre of the upright image, in image widths,'
        ' positive to the right. Used with focal_px or hfov_deg.', minimum=-0.5, maximum=0.5,
        read_only=True)
    camera_pitch_deg: float = parameter(
        0.0, 'Pitch of the camera, positive down. 0: estimated from the drive.', unit='deg',
        minimum=-60.0, maximum=60.0, read_only=True)
    camera_roll_deg: float = parameter(
        0.0, 'Roll of the camera, positive right side down. Used with focal_px or hfov_deg.',
        unit='deg', minimum=-60.0, maximum=60.0, read_only=True)
    camera_height: float = parameter(
        0.0, 'Height of the camera above the road. With it, the distance measured on the road is'
        ' in metres, and so are odom, speed and a path from the heading. Requires a focal length.'
        ' 0 if unknown.', unit='m', minimum=0.0, maximum=100.0, read_only=True, group=Group.USER)
    camera_height_deviation: float = parameter(
        0.04, 'Standard deviation of camera_height, as a fraction of it. It is part of the'
        ' variances of odom and speed.', minimum=0.0, maximum=1.0, read_only=True)
    estimate_fov: bool = parameter(
        False, 'Deprecated; code_source auto always learns an unknown camera. With another code'
        ' source: whether the camera is learned from the drive if neither focal_px nor hfov_deg'
        ' is set.',
        read_only=True)
    rectified: bool = parameter(
        False, 'Whether the images are rectified. Rectified images are described by P of'
        ' camera_info, others by K and the distortion.', read_only=True, group=Group.VEHICLE)
    code_step: float = parameter(
        0.0, 'Length of a link of the chain code of equal links, which has one direction per link'
        ' at any speed. In metres if camera_height or a speed is known, else in camera heights.'
        ' Requires a focal length. 0 makes no links.', minimum=0.0,
        maximum=1000.0, read_only=True, group=Group.VEHICLE)
    window: str = parameter(
        Window.SQRT_HANN.value, 'Window function applied to the frames before correlation. It'
        ' affects the shift only, as do the rows and columns used, decimation and the tests of'
        ' single pairs; the heading has its own.',
        choices=tuple(form.value for form in Window))
    transform: str = parameter(
        TransformLibrary.AUTO.value, 'Library that computes the Fourier transforms: opencv,'
        ' scipy, or the faster one of those installed (auto). The codes are the same.',
        choices=tuple(each.value for each in TransformLibrary), read_only=True)
    rows_from: float = parameter(
        0.0, 'First row used, as a fraction of the height from the top.',
        minimum=0.0, maximum=1.0)
    rows_to: float = parameter(
        1.0, 'Last row used, as a fraction of the height from the top.',
        minimum=0.0, maximum=1.0)
    columns_from: float = parameter(
        0.0, 'First column used, as a fraction of the width from the left.',
        minimum=0.0, maximum=1.0)
    columns_to: float = parameter(
        1.0, 'Last column used, as a fraction of the width from the left.',
        minimum=0.0, maximum=1.0)
    decimation: int = parameter(
        1, 'Number of pixels in each direction that are averaged into one before correlation.'
        ' Shifts stay in pixels of the full image.', minimum=1, maximum=16)
    rotate_180: bool = parameter(
        False, 'Whether the camera is mounted upside down.', group=Group.USER)
    max_gap: float = parameter(
        0.0, 'Longest interval between two images that are compared. 0 for no limit.', unit='s',
        minimum=0.0, maximum=1e6, group=Group.VEHICLE)
    nominal_period: float = parameter(
        0.0, 'Frame interval for which the threshold is meant. The shift is scaled to this'
        ' interval before it is compared. 0 does not scale it.', unit='s', minimum=0.0,
        maximum=1e6)
    min_significance: float = parameter(
        0.0, 'Significance of the correlation peak, in standard deviations of the noise, from'
        ' which a pair is measured. 0 accepts every pair.', minimum=0.0, maximum=1000.0,
        group=Group.VEHICLE)
    look_past_zero: bool = parameter(
        False, 'Whether a peak at zero shift, such as that of a bonnet or a text overlay, is'
        ' replaced by a second peak that most of the image follows.', group=Group.VEHICLE)
    still_frames: int = parameter(
        0, 'Number of pairs over which the image motion is averaged to detect a standing vehicle.'
        ' 0 disables the detection.', minimum=0, maximum=1000, group=Group.VEHICLE)
    still_motion: float = parameter(
        StillnessSettings().max_motion, 'Mean image motion per pair below which the vehicle'
        ' stands, as a fraction of the image width.', minimum=1e-9, maximum=1.0)
    confirm_frames: int = parameter(
        1, 'A turn starts after this number of consecutive pairs beyond the threshold.',
        minimum=1, maximum=1000,
        group=Group.VEHICLE)
    release_frames: int = parameter(
        1, 'A turn ends after this number of consecutive pairs that do not continue it.',
        minimum=1, maximum=1000,
        group=Group.VEHICLE)
    mask_file: str = parameter(
        '', 'Greyscale image of the size of the received images: the weight of each pixel, black'
        ' where the image never moves. Empty uses all pixels.', read_only=True,
        group=Group.VEHICLE)
    threads: int = parameter(
        1, 'Number of threads of OpenCV. 0 leaves the choice to OpenCV.', minimum=0, maximum=64)
    frame_id: str = parameter(
        '', 'Frame of the published pose, path and odometry. Empty: odom for what is in metres'
        ' (see camera_height and speed), phase_traj for what has no metric scale.', group=Group.VEHICLE)
    step_length: float = parameter(
        1.0, 'Length of a step or of a camera height in the published path. A path from the'
        ' heading in metres is not scaled.', unit='m', **POSITIVE)
    path_from: str = parameter(
        PathSource.AUTO.value, 'What the path is drawn from: the direction codes, as in the paper'
        ' (codes), or the measured heading (heading; requires a focal length). auto is heading'
        ' with code_source auto, else codes.',
        choices=tuple(each.value for each in PathSource), read_only=True)
    speed: float = parameter(
        0.0, 'Speed of the vehicle, if it is constant. With it, odom and a path from the heading'
        ' are in metres. Requires a focal length. 0 if unknown.', unit='m/s',
        minimum=0.0, maximum=MOST_SPEED, read_only=True, group=Group.VEHICLE)
    use_speed_topic: bool = parameter(
        False, 'Whether the topic speed provides the speed of the vehicle instead.',
        read_only=True, group=Group.VEHICLE)
    speed_type: str = parameter(
        SpeedType.TWIST.value, 'Message type of the topic speed: TwistStamped,'
        ' TwistWithCovarianceStamped or Odometry. A replay accepts any of them.',
        choices=tuple(each.value for each in SpeedType), read_only=True, group=Group.VEHICLE)
    max_path_poses: int = parameter(
        1000, 'Maximum number of poses of the published path. A path from the codes holds its'
        ' newest corner points and the current pose; a path from the heading holds poses of the'
        ' whole way, thinned.',
        minimum=2, maximum=100_000, read_only=True)
    path_rate: float = parameter(
        5.0, 'Maximum rate of the published path. An unchanged path is not published.',
        unit='Hz', minimum=0.1, maximum=100.0, read_only=True)
    chain_code_runs: int = parameter(
        50, 'Number of runs of each code in the chain code text. It holds the newest runs.',
        minimum=1, maximum=1000)
    output_dir: str = parameter(
        '', 'Folder in which the node saves each drive, to a folder named after the node, at the'
        ' end, before a reset, and with ~/save. If it is empty, the node writes no files.',
        read_only=True, group=Group.VEHICLE)
    record_shifts: bool = parameter(
        False, 'Whether one row per pair is written to shifts.csv in the folder of the drive.',
        read_only=True, group=Group.VEHICLE)
    publish_tf: bool = parameter(
        False, 'Whether the transform from frame_id to child_frame_id is published on /tf (needs'
        ' tf2_msgs).', read_only=True, group=Group.VEHICLE)
    child_frame_id: str = parameter(
        'base_link', 'Frame of the vehicle, for publish_tf and the odometry.', group=Group.VEHICLE)
    max_runs: int = parameter(
        100_000, 'Number of runs of each code that the node keeps. The totals count all runs.',
        minimum=1000, maximum=10_000_000, read_only=True)

    def __post_init__(self) -> None:
        """Check every value against its declaration."""
        for spec in specs():
            spec.check(getattr(self, spec.name))
        for side in ('rows', 'columns'):
            begin, end = getattr(self, f'{side}_from'), getattr(self, f'{side}_to')
            if begin >= end:
                raise ParameterError(
                    f'parameters {side}_from and {side}_to are {begin} and {end}: the first must'
                    ' be smaller')
        for name in ('frame_id', 'child_frame_id'):
            frame = getattr(self, name)
            if name == 'frame_id' and not frame:
                continue
            if not frame or frame.startswith('/') or frame != frame.strip():
                raise ParameterError(
                    f'parameter {name!r} is {frame!r}: give the name of a frame, without a leading'
                    ' slash')
        frames = {self.frame_id} if self.frame_id else {_ODOM, _UNSCALED}
        if self.child_frame_id in frames and (self.publish_tf or self.metric):
            raise ParameterError(
                f"parameters 'frame_id' and 'child_frame_id' are both {self.child_frame_id!r}: give"
                ' them different names')
        if 0 < self.hfov_deg < LEAST_HFOV_DEG:
            raise ParameterError(
                f"parameter 'hfov_deg' is {self.hfov_deg}: give {LEAST_HFOV_DEG} or more, or 0 if"
                ' it is unknown')
        if 0 < self.code_step < LEAST_STEP:
            raise ParameterError(
                f"parameter 'code_step' is {self.code_step}: give {LEAST_STEP} or more, or 0 for"
                ' no links')
        try:
            self._lens()
        except ValueError as error:
            raise ParameterError(f'the parameters of the camera are not consistent: {error}') \
                from None
        if self.connectivity == 8 and self.codes_from is not CodeSource.HEADING:
            raise ParameterError(
                "parameter 'connectivity' is 8: it requires code_source heading; the other code"
                ' sources give right angles only')
        if self.speed > 0 and self.use_speed_topic:
            raise ParameterError(
                "parameters 'speed' and 'use_speed_topic' are both set: give one of them")

    def with_values(self, values: Mapping[str, object]) -> 'Parameters':
        """
        Return a copy with some values replaced.

        Raises
        ------
        ParameterError
            A name is unknown, or a value is not allowed.

        """
        known = [spec.name for spec in specs()]
        for name in values:
            if name not in known:
                near = nearest(name)
                hint = f'did you mean {near!r}?' if near else f'give one of {", ".join(known)}'
                raise ParameterError(f'there is no parameter {name!r}: {hint}')
        return replace(self, **cast('dict[str, Any]', dict(values)))

    @property
    def notices(self) -> tuple[str, ...]:
        """Return notices for the user about the values, one line each."""
        found = []
        if self.estimate_fov:
            found.append(
                'the parameter estimate_fov is deprecated: code_source auto, the default, always'
                ' learns an unknown camera')
        if self.publish_tf and not self.metric:
            found.append(
                'publish_tf is set, but no metres are known: the transform is in steps or heights'
                ' of the camera; set camera_height or a speed')
        if self.frame_id == _ODOM and not self.metric:
            found.append(
                "frame_id is 'odom', but no metres are known: set camera_height or a speed")
        return tuple(found)

    @property
    def codes_from(self) -> CodeSource:
        """Return what the codes are made from. With a threshold, AUTO is SHIFT."""
        if self.code_source == CodeSource.AUTO.value and (
                self.threshold > 0 or self.threshold_deg_s > 0):
            return CodeSource.SHIFT
        return CodeSource(self.code_source)

    @property
    def codes_from_heading(self) -> bool:
        """Return whether the codes are made from the heading or the turns, not from the shift."""
        return self.codes_from is not CodeSource.SHIFT

    @property
    def threshold_px(self) -> float:
        """Return the threshold T in pixels per frame."""
        return self.threshold or PAPER_THRESHOLD

    # Read for each pair of frames.
    @cached_property
    def drawn_from(self) -> PathSource:
        """Return what the path is drawn from, CODES or HEADING."""
        return self.estimator_settings().drawn_from

    @property
    def measures_heading(self) -> bool:
        """Return whether heading and turns are measured."""
        return self.estimator_settings().measures_heading

    @property
    def learns_camera(self) -> bool:
        """Return whether an unknown camera is learned from the drive."""
        return self.estimator_settings().learns_lens

    @property
    def metric(self) -> bool:
        """Return whether a speed or the camera's height gives odometry in metres."""
        return self.speed > 0 or self.use_speed_topic or self.camera_height > 0

    @property
    def length_unit(self) -> LengthUnit:
        """Return the unit of distances and links."""
        return self.estimator_settings().length_unit

    @property
    def path_frame(self) -> str:
        """Return the frame of the pose and the path: odom (REP 105) only where it is in metres."""
        return self.frame_id or (_ODOM if self.path_in_metres else _UNSCALED)

    @property
    def odom_frame(self) -> str:
        """Return the frame of the odometry, which is in metres."""
        return self.frame_id or _ODOM

    @property
    def path_in_metres(self) -> bool:
        """Return whether the drawn path is in metres, and not in camera heights or steps."""
        return self.metric and self.drawn_from is PathSource.HEADING

    @property
    def path_scale(self) -> float:
        """Return the length of a unit of the path, in metres."""
        return 1.0 if self.path_in_metres else self.step_length

    def estimator_settings(self) -> EstimatorSettings:
        """Return the settings of a live estimator, bounded in memory."""
        return EstimatorSettings(
            threshold=self.threshold_px,
            threshold_deg_s=self.threshold_deg_s,
            window=Window(self.window),
            transform=TransformLibrary(self.transform),
            view=View(
                rows=(self.rows_from, self.rows_to),
                columns=(self.columns_from, self.columns_to),
                decimation=self.decimation,
                rotate_180=self.rotate_180),
            max_gap=self.max_gap,
            nominal_period=self.nominal_period,
            confirm_frames=self.confirm_frames,
            release_frames=self.release_frames,
            code_source=self.codes_from,
            connectivity=self.connectivity,
            lens=self._lens(),
            estimate_fov=self.estimate_fov,
            path_from=PathSource(self.path_from),
            speed=self.speed,
            awaits_speeds=self.use_speed_topic,
            camera_height=self.camera_height,
            camera_height_deviation=self.camera_height_deviation,
            camera_pitch_deg=self.camera_pitch_deg,
            code_step=self.code_step,
            gate=self._gate(),
            stillness=StillnessSettings(
                frames=self.still_frames, max_motion=self.still_motion,
            ) if self.still_frames else None,
            max_runs=self.max_runs,
            max_speeds=_MAX_SPEEDS,
            # The current pose is one of the poses.
            max_corners=self.max_path_poses - 1,
        )

    def _lens(self) -> Lens | None:
        if self.focal_px == 0.0 and self.hfov_deg == 0.0:
            return None
        return Lens(
            focal_px=self.focal_px, hfov_deg=self.hfov_deg, straightness=self.lens_straightness,
            offset=self.lens_offset, pitch_deg=self.camera_pitch_deg,
            roll_deg=self.camera_roll_deg)

    def _gate(self) -> GateSettings | None:
        if self.min_significance == 0.0 and not self.look_past_zero:
            return None
        return GateSettings(
            min_significance=self.min_significance, look_past_zero=self.look_past_zero)


@cache
def specs() -> tuple[Spec, ...]:
    """Return the declarations of all parameters, in the order of the table."""
    table = []
    for declared in fields(Parameters):
        assert declared.default is not MISSING
        table.append(Spec(name=declared.name, default=declared.default, **declared.metadata))
    return tuple(table)


def nearest(name: str) -> str:
    """Return the name of a parameter that was probably meant by ``name``; empty if none is."""
    return next(iter(get_close_matches(name, [spec.name for spec in specs()], n=1)), '')
