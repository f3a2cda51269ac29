# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The parameters, declared once for the node, the command line and the docs.

This module does not use rclpy. ``phase_traj_ros.ros.nodes.live_parameters`` declares the table on
a node, and ``phase_traj_ros.io.params_file`` reads the values from a ROS parameter file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from functools import cache, cached_property
from typing import Any, cast

from phase_traj_ros.core import EstimatorSettings, PAPER_THRESHOLD, View
from phase_traj_ros.core.camera.lens import Lens
from phase_traj_ros.core.camera.lens_family import PINHOLE, STRAIGHTNESS_RANGE
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.core.correlation.quality import GateSettings, StillnessSettings
from phase_traj_ros.core.path.speed import MAX_SPEED
from phase_traj_ros.core.settings import CodeSource, PathSource
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.parameter_spec import Group, parameter, REMOVED, Spec, Value

NODE_NAME = 'phase_traj'

MAX_PATH_POSES = 1000
"""Maximum number of poses of the published path; a longer one is thinned."""

# Of what is measured with the lens, in a description.
_NEEDS_LENS = 'Unless the codes come from the turns (auto), it requires a focal length.'
# Frames of REP 105 for a pose in metres, and of this package for others.
_ODOM, _UNSCALED = 'odom', NODE_NAME
MAP_FRAME = 'map'
"""Frame of ~/odom_map, ~/roads and ~/candidates (REP 105): x east and y north of the datum."""
_OF_MAP = ('map_roads', 'map_datum', 'publish_map_tf')
_OF_LENS = ('lens_straightness', 'lens_offset')
_GIVE_METRES = 'set camera_height or a speed, unless /tf_static gives the height'
# Runs of each code that a live node keeps; the totals count all runs.
_MAX_RUNS = 100_000
# Ten seconds at a thousand speeds a second.
_MAX_SPEEDS = 10_000


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
        'raw', 'Images to subscribe to: raw images on image, or compressed images on'
        ' image/compressed.', choices=('raw', 'compressed'), read_only=True, group=Group.VEHICLE)
    threshold: float = parameter(
        0.0, 'Horizontal shift between two frames from which a pair is a turn, as in the paper.'
        f' 0 leaves the choice to code_source; with code_source shift, 0 is {PAPER_THRESHOLD:g}.',
        unit='px/frame', minimum=0.0, maximum=1e4, group=Group.USER)
    code_source: str = parameter(
        CodeSource.AUTO.value, 'What the codes are made from: the turns of the measured heading'
        ' (auto; an unknown camera is learned from the drive), the shift and a threshold, as in'
        ' the paper (shift), or the quantised heading (heading; requires a focal length). If a'
        ' threshold is set, auto is shift.',
        choices=tuple(each.value for each in CodeSource), read_only=True, group=Group.VEHICLE)
    connectivity: int = parameter(
        4, 'Number of directions of the direction code: 4 as in the paper, or 8 (Freeman). 8'
        ' requires code_source heading.', choices=(4, 8), read_only=True)
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
        ' positive to the right. Used with focal_px or hfov_deg. 0: learned from the turns with'
        ' auto.', minimum=-0.5, maximum=0.5, read_only=True)
    camera_pitch_deg: float = parameter(
        0.0, 'Pitch of the camera, positive down. 0 if unknown. The drive improves it.',
        unit='deg', minimum=-60.0, maximum=60.0, read_only=True)
    camera_roll_deg: float = parameter(
        0.0, 'Roll of the camera, positive right side down. 0 if unknown. The drive improves it.'
        ' Used with a focal length or a calibration.',
        unit='deg', minimum=-60.0, maximum=60.0, read_only=True)
    camera_height: float = parameter(
        0.0, 'Height of the camera above the road. With it, the distance measured on the road is'
        f' in metres, and so are odom, speed and a path from the heading. {_NEEDS_LENS} 0 if'
        ' unknown.', unit='m', minimum=0.0, maximum=100.0, read_only=True, group=Group.USER)
    camera_height_deviation: float = parameter(
        0.04, 'Standard deviation of camera_height, as a fraction of it. It is part of the'
        ' variances of odom and speed.', minimum=0.0, maximum=1.0, read_only=True)
    rectified: bool = parameter(
        False, 'Whether the images are rectified. Rectified images are described by P of'
        ' camera_info, others by K and the distortion.', read_only=True, group=Group.VEHICLE)
    code_step: float = parameter(
        0.0, 'Length of a link of the chain code of equal links, which has one direction per link'
        ' at any speed. In metres if camera_height or a speed is known, else in camera heights.'
        f' {_NEEDS_LENS} At least 0.1; 0 makes no links.', minimum=0.0, maximum=1000.0,
        read_only=True, group=Group.VEHICLE)
    rotate_180: bool = parameter(
        False, 'Whether the camera is mounted upside down.', group=Group.USER)
    max_gap: float = parameter(
        0.0, 'Longest interval between two images that are compared. 0 for no limit.', unit='s',
        minimum=0.0, maximum=1e6, group=Group.VEHICLE)
    still_time: float = parameter(
        0.0, 'Time over which the image motion is averaged to detect a standing vehicle. 0'
        ' disables the detection.', unit='s', minimum=0.0, maximum=10.0, group=Group.VEHICLE)
    mask_file: str = parameter(
        '', 'Greyscale image of the size of the received images: the weight of each pixel, black'
        ' where the image never moves. Empty uses all pixels.', read_only=True,
        group=Group.VEHICLE)
    frame_id: str = parameter(
        '', 'Frame of the published pose, path and odometry. Empty: odom for what is in metres'
        ' (see camera_height and speed), phase_traj for what has no metric scale.',
        read_only=True, group=Group.VEHICLE)
    path_from: str = parameter(
        PathSource.AUTO.value, 'What the path is drawn from: the direction codes, as in the paper'
        ' (codes), or the measured heading (heading; unless the codes come from the turns, it'
        ' requires a focal length). auto is heading with code_source auto, else codes.',
        choices=tuple(each.value for each in PathSource), read_only=True)
    speed: float = parameter(
        0.0, 'Speed of the vehicle, if it is constant. With it, odom and a path from the heading'
        f' are in metres. {_NEEDS_LENS} 0 if unknown.', unit='m/s',
        minimum=0.0, maximum=MAX_SPEED, read_only=True, group=Group.VEHICLE)
    use_speed_topic: bool = parameter(
        False, 'Whether the topic speed provides the speed of the vehicle, instead of the'
        ' parameter speed.', read_only=True, group=Group.VEHICLE)
    output_dir: str = parameter(
        '', 'Folder in which the node saves each drive, to a folder named after the node, at the'
        ' end, before a reset, and with ~/save. If it is empty, the node writes no files.',
        read_only=True, group=Group.VEHICLE)
    publish_tf: bool = parameter(
        False, 'Whether the transform from frame_id to child_frame_id is published on /tf (needs'
        ' tf2_msgs, and metres).', read_only=True, group=Group.VEHICLE)
    child_frame_id: str = parameter(
        'base_link', 'Frame of the vehicle, for publish_tf and the odometry.', read_only=True,
        group=Group.VEHICLE)
    map_file: str = parameter(
        '', 'Road map on which the vehicle is located: an extract of OpenStreetMap (.osm.pbf,'
        ' .osm, .osm.gz or .osm.bz2). Empty: the vehicle is not located.', read_only=True,
        group=Group.VEHICLE)
    map_roads: str = parameter(
        'car', 'Roads of the map to use: those that a car may drive, or paths as well.',
        choices=('car', 'all'), read_only=True)
    map_datum: str = parameter(
        '', 'Origin of the frame map, as LAT,LON in degrees. Empty: the middle of the map.',
        read_only=True)
    publish_map_tf: bool = parameter(
        False, 'Whether the transform from map to the frame of odom is published on /tf, once the'
        ' place is known (needs tf2_msgs, and metres).', read_only=True)
    shift_decimation: int = parameter(
        1, 'Number of pixels in each direction that are averaged into one before correlation.'
        ' Shifts stay in pixels of the full image.', minimum=1, maximum=16, group=Group.SHIFT)
    shift_nominal_period: float = parameter(
        0.0, 'Frame interval for which the threshold is meant. The shift is scaled to this'
        ' interval before it is compared. 0 does not scale it.', unit='s', minimum=0.0,
        maximum=1e6, group=Group.SHIFT)
    shift_min_significance: float = parameter(
        0.0, 'Significance of the correlation peak, in standard deviations of the noise, from'
        ' which a pair is measured. 0 accepts every pair.', minimum=0.0, maximum=1000.0,
        group=Group.SHIFT)
    shift_look_past_zero: bool = parameter(
        False, 'Whether a peak at zero shift, such as that of a bonnet or a text overlay, is'
        ' replaced by a second peak that most of the image follows.', group=Group.SHIFT)
    shift_confirm_frames: int = parameter(
        1, 'A turn starts after this number of consecutive pairs beyond the threshold.',
        minimum=1, maximum=1000, group=Group.SHIFT)
    shift_release_frames: int = parameter(
        1, 'A turn ends after this number of consecutive pairs that do not continue it.',
        minimum=1, maximum=1000, group=Group.SHIFT)

    def __post_init__(self) -> None:
        """Check every value against its declaration."""
        for spec in specs():
            spec.check(self.value(spec))
        if self.speed > 0 and self.use_speed_topic:
            raise ParameterError(
                "parameters 'speed' and 'use_speed_topic' are both set: give one of them")
        try:
            settings = self.settings
        except ValueError as error:
            raise ParameterError(f'the parameters are not consistent: {error}') from None
        for name, frame in (
                ('frame_id', self.odom_frame), ('child_frame_id', self.child_frame_id)):
            if not frame or frame.startswith('/') or frame != frame.strip():
                raise ParameterError(
                    f'parameter {name!r} is {frame!r}: give the name of a frame, without a leading'
                    ' slash')
        if self.child_frame_id in (self.odom_frame, self.path_frame) and (
                self.publish_tf or settings.metric):
            raise ParameterError(
                f"parameters 'frame_id' and 'child_frame_id' are both {self.child_frame_id!r}:"
                ' give them different names')
        if self.publish_map_tf and self.odom_frame == MAP_FRAME:
            raise ParameterError(
                f"parameter 'frame_id' is {MAP_FRAME!r}, the parent that publish_map_tf gives it:"
                ' leave it empty, or give another frame')

    def with_values(self, values: Mapping[str, object]) -> 'Parameters':
        """
        Return a copy with some values replaced.

        Raises
        ------
        ParameterError
            A name is unknown, or a value is not allowed.

        """
        fields_of = {spec.name: spec.field for spec in specs()}
        for name in values:
            if name not in fields_of:
                raise ParameterError(unknown_parameter(name))
        return replace(self, **{
            fields_of[name]: cast('Any', value) for name, value in values.items()})

    def value(self, spec: Spec) -> Value:
        """Return the value of a parameter."""
        return cast('Value', getattr(self, spec.field))

    @property
    def changed(self) -> tuple[Spec, ...]:
        """Return the parameters that differ from their defaults."""
        return tuple(spec for spec in specs() if self.value(spec) != spec.default)

    @property
    def notices(self) -> tuple[str, ...]:
        """Return notices for the user about the values, one line each."""
        found, settings = [], self.settings
        unused = [
            spec.name for spec in self.changed
            if spec.group is Group.SHIFT or spec.name == 'threshold']
        if settings.by_heading and unused:
            found.append(
                f'no effect with code_source {settings.code_source.value}: {", ".join(unused)}'
                " (of the paper's rule, code_source shift)")
        for needed, known, names in (
                ('map_file', self.map_file, _OF_MAP),
                ('focal_px or hfov_deg', settings.lens, _OF_LENS),
                ('camera_height, unless /tf_static gives the height', self.camera_height,
                 ('camera_height_deviation',))):
            unused = [spec.name for spec in self.changed if spec.name in names]
            if unused and not known:
                found.append(f'no effect without {needed}: {", ".join(unused)}')
        if not settings.metric:
            found += [
                f'{name} is set, but no metres are known: nothing is published; {_GIVE_METRES}'
                for name, wanted in (
                    ('publish_tf', self.publish_tf),
                    ('publish_map_tf', self.publish_map_tf and self.map_file)) if wanted]
            if self.frame_id == _ODOM:
                found.append(f"frame_id is 'odom', but no metres are known: {_GIVE_METRES}")
        return tuple(found)

    @property
    def path_frame(self) -> str:
        """Return the frame of the pose and the path: odom (REP 105) only where it is in metres."""
        in_metres = self.settings.metric and self.settings.draws_heading
        return self.frame_id or (_ODOM if in_metres else _UNSCALED)

    @property
    def odom_frame(self) -> str:
        """Return the frame of the odometry, which is in metres."""
        return self.frame_id or _ODOM

    # Read for each pair of frames.
    @cached_property
    def settings(self) -> EstimatorSettings:
        """Return the settings of a live estimator, bounded in memory."""
        source = CodeSource(self.code_source)
        if source is CodeSource.AUTO and self.threshold > 0:
            source = CodeSource.SHIFT
        settings = EstimatorSettings(
            threshold=self.threshold or PAPER_THRESHOLD,
            view=View(rotate_180=self.rotate_180),
            max_gap=self.max_gap,
            code_source=source,
            connectivity=self.connectivity,
            lens=self._lens(),
            path_from=PathSource(self.path_from),
            speed=self.speed,
            awaits_speeds=self.use_speed_topic,
            camera_height=self.camera_height,
            camera_height_deviation=self.camera_height_deviation,
            camera_pitch_deg=self.camera_pitch_deg,
            code_step=self.code_step,
            stillness=StillnessSettings(seconds=self.still_time) if self.still_time else None,
            max_runs=_MAX_RUNS,
            max_speeds=_MAX_SPEEDS,
            # The current pose is one of the poses.
            max_corners=MAX_PATH_POSES - 1,
        )
        return settings if settings.by_heading else self._by_shift(settings)

    def _by_shift(self, settings: EstimatorSettings) -> EstimatorSettings:
        """Return settings with those of the paper's rule."""
        gate = None
        if self.shift_min_significance > 0.0 or self.shift_look_past_zero:
            gate = GateSettings(
                min_significance=self.shift_min_significance,
                look_past_zero=self.shift_look_past_zero)
        return replace(
            settings, gate=gate,
            view=View(decimation=self.shift_decimation, rotate_180=self.rotate_180),
            nominal_period=self.shift_nominal_period,
            confirm_frames=self.shift_confirm_frames,
            release_frames=self.shift_release_frames)

    def calibrated(self, camera: CameraModel) -> Lens:
        """Return the lens of a calibrated camera that is mounted as the parameters say."""
        return Lens(
            camera=camera, pitch_deg=self.camera_pitch_deg, roll_deg=self.camera_roll_deg)

    def _lens(self) -> Lens | None:
        if self.focal_px == 0.0 and self.hfov_deg == 0.0:
            return None
        return Lens(
            focal_px=self.focal_px, hfov_deg=self.hfov_deg, straightness=self.lens_straightness,
            offset=self.lens_offset, pitch_deg=self.camera_pitch_deg,
            roll_deg=self.camera_roll_deg)


@cache
def specs() -> tuple[Spec, ...]:
    """Return the declarations of all parameters, in the order of the table."""
    return tuple(
        Spec(field=each.name, default=cast('Value', each.default), **each.metadata)
        for each in fields(Parameters))


def unknown_parameter(name: str) -> str:
    """Return what to do about a parameter that is not in the table."""
    if name in REMOVED:
        return f'the parameter {name!r} was removed: {REMOVED[name]}'
    known = [spec.name for spec in specs()]
    near = get_close_matches(name, known, n=1)
    hint = f'did you mean {near[0]!r}?' if near else f'give one of {", ".join(known)}'
    return f'there is no parameter {name!r}: {hint}'
