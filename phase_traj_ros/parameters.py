# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The parameters, declared once for the node, the command line and the docs.

Knows nothing of rclpy: ``phase_traj_ros.ros.declare`` declares this table on a node, and
``phase_traj_ros.io.params_file`` reads it from a ROS parameter file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, MISSING, replace
from difflib import get_close_matches
from enum import Enum
from functools import cache
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

# Ten seconds at a thousand speeds a second.
_MAX_SPEEDS = 10_000


class Transport(Enum):
    """How images come."""

    RAW = 'raw'
    COMPRESSED = 'compressed'


class SpeedType(Enum):
    """What the vehicle's speed comes in."""

    TWIST = 'twist'
    TWIST_WITH_COVARIANCE = 'twist_with_covariance'
    ODOMETRY = 'odometry'


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """
    One set of values for all parameters; the defaults take any camera, and take no option.

    Raises
    ------
    ParameterError
        A value is of the wrong type or out of its range.

    """

    image_transport: str = parameter(
        Transport.RAW.value, 'Which images to subscribe to: raw ones on image, or compressed ones'
        ' on image/compressed.', choices=tuple(each.value for each in Transport),
        read_only=True, group=Group.VEHICLE)
    max_pixels: int = parameter(
        1 << 26, 'Compressed images of more pixels are refused before they are decoded.',
        minimum=64, maximum=1 << 30, read_only=True)
    threshold: float = parameter(
        0.0, 'Horizontal shift between two frames from which a pair counts as a turn, by the rule'
        f' of the paper. 0 leaves the choice to code_source, and is {PAPER_THRESHOLD:g} with'
        ' shift.',
        unit='px/frame', group=Group.USER, **NOT_NEGATIVE)
    threshold_deg_s: float = parameter(
        0.0, 'Yaw rate from which a pair counts as a turn, instead of threshold: it is the'
        ' same for all cameras and frame rates. Takes a focal length; 0 uses threshold.',
        unit='deg/s', minimum=0.0, maximum=1000.0)
    code_source: str = parameter(
        CodeSource.AUTO.value, 'What the codes are made from: the turns, with a camera that is'
        ' learned from the drive where it is not known (auto); the shift against the threshold'
        ' (the paper); or the heading, quantised, which takes a focal length. A threshold makes'
        ' shift of auto.',
        choices=tuple(each.value for each in CodeSource), read_only=True, group=Group.VEHICLE)
    connectivity: int = parameter(
        4, 'Directions that the heading is quantised to: the four of the paper, or the eight of'
        ' Freeman, which take code_source heading.', minimum=4, maximum=8, step=4, read_only=True)
    focal_px: float = parameter(
        0.0, 'Focal length of the camera in pixels of the full image; with it the heading and the'
        ' turns are measured. 0 if not known.', unit='px', minimum=0.0, maximum=1e6,
        read_only=True, group=Group.VEHICLE)
    hfov_deg: float = parameter(
        0.0, 'Horizontal field of view of the camera, which stands in for focal_px where that is'
        ' 0. Where both are 0 and a focal length is needed, that of camera_info is taken.',
        unit='deg', minimum=0.0, maximum=179.0, read_only=True, group=Group.USER)
    lens_straightness: float = parameter(
        PINHOLE, 'Kind of lens, with focal_px or hfov_deg: 1 for a pinhole, 0 for an equidistant'
        ' fisheye. phase_traj calibrate tells it.', minimum=STRAIGHTNESS_RANGE[0],
        maximum=STRAIGHTNESS_RANGE[1], read_only=True)
    lens_offset: float = parameter(
        0.0, 'How far the principal point is to the right of the middle of the upright image,'
        ' with focal_px or hfov_deg, in widths of the image.', minimum=-0.5, maximum=0.5,
        read_only=True)
    camera_pitch_deg: float = parameter(
        0.0, 'How far the camera looks down. 0: found from the drive.', unit='deg',
        minimum=-60.0, maximum=60.0, read_only=True)
    camera_roll_deg: float = parameter(
        0.0, 'How far the right side of the camera hangs down, with focal_px or hfov_deg.',
        unit='deg', minimum=-60.0, maximum=60.0, read_only=True)
    camera_height: float = parameter(
        0.0, 'Height of the camera above the road: with it the distance that the road tells is in'
        ' metres, and so are odom, speed and a path from the heading. Takes a focal length; 0 if'
        ' not known.', unit='m', minimum=0.0, maximum=100.0, read_only=True, group=Group.USER)
    camera_height_deviation: float = parameter(
        0.04, 'Standard deviation of camera_height, as a share of it: part of the variances of'
        ' odom and speed.', minimum=0.0, maximum=1.0, read_only=True)
    estimate_fov: bool = parameter(
        False, 'Old name of what code_source auto does by itself. With another code source:'
        ' whether the camera is learned from the drive where neither focal_px nor hfov_deg is'
        ' given.',
        read_only=True)
    rectified: bool = parameter(
        False, 'Whether the images are rectified: then P of camera_info holds for them, else K'
        ' and its distortion.', read_only=True, group=Group.VEHICLE)
    code_step: float = parameter(
        0.0, 'Length of a link of the chain code of equal links, a direction for each such step of'
        ' the way, whatever the speed: in metres where a camera_height or a speed is known, else'
        ' in heights of the camera. Takes a focal length; 0 makes no links.', minimum=0.0,
        maximum=1000.0, read_only=True, group=Group.VEHICLE)
    window: str = parameter(
        Window.SQRT_HANN.value, 'Taper of the frames before they are correlated. This, the band of'
        ' rows and columns, decimation and the tests of single pairs are about the shift; the'
        ' heading has its own.',
        choices=tuple(form.value for form in Window))
    transform: str = parameter(
        TransformLibrary.AUTO.value, 'Which library computes the Fourier transforms: OpenCV,'
        ' scipy, or whichever of those installed is known to be the faster one. The codes are'
        ' the same.',
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
        1, 'Pixels in each direction averaged into one before correlating; shifts stay in pixels'
        ' of the full image.', minimum=1, maximum=16)
    rotate_180: bool = parameter(
        False, 'Whether the camera is mounted upside down.', group=Group.USER)
    max_gap: float = parameter(
        0.0, 'Longest time between two images that are compared; 0 for any.', unit='s',
        minimum=0.0, maximum=1e6, group=Group.VEHICLE)
    nominal_period: float = parameter(
        0.0, 'Time between two images that the threshold is meant for: the shift is judged as if'
        ' they were that far apart; 0 judges it as it is.', unit='s', minimum=0.0, maximum=1e6)
    min_significance: float = parameter(
        0.0, 'Standard deviations by which the correlation peak has to stand out of noise for a'
        ' pair to count as measured; 0 believes every pair.', minimum=0.0, maximum=1000.0,
        group=Group.VEHICLE)
    look_past_zero: bool = parameter(
        False, 'Whether a peak at zero shift, as of a bonnet or a burnt-in text, gives way to a'
        ' second one that most of the picture follows.', group=Group.VEHICLE)
    still_frames: int = parameter(
        0, 'Pairs over which the motion of the picture is averaged to tell whether the vehicle'
        ' stands; 0 never tells.', minimum=0, maximum=1000, group=Group.VEHICLE)
    still_motion: float = parameter(
        StillnessSettings().max_motion, 'Mean motion per pair below which the vehicle stands, as'
        ' a share of the width.', minimum=1e-9, maximum=1.0)
    confirm_frames: int = parameter(
        1, 'Pairs in a row beyond the threshold that make a turn.', minimum=1, maximum=1000,
        group=Group.VEHICLE)
    release_frames: int = parameter(
        1, 'Pairs in a row that end a turn: one less may be wrong.', minimum=1, maximum=1000,
        group=Group.VEHICLE)
    mask_file: str = parameter(
        '', 'Grey picture of the size of the images as they come: how much each pixel counts,'
        ' black for what never moves. Empty uses all.', read_only=True, group=Group.VEHICLE)
    threads: int = parameter(
        1, 'Threads that OpenCV may use; 0 leaves it to OpenCV.', minimum=0, maximum=64)
    frame_id: str = parameter(
        'phase_traj', 'Frame of the published pose, path and odometry. A path without a speed or'
        ' a camera_height has no metric scale, so it is not odom.', group=Group.VEHICLE)
    step_length: float = parameter(
        1.0, 'Length drawn for each step or camera height of the path; a path from the heading in'
        ' metres is drawn as it is.', unit='m', **POSITIVE)
    path_from: str = parameter(
        PathSource.AUTO.value, 'What the path is drawn from: the direction codes (the paper), or'
        ' the measured heading, which takes a focal length. auto is the heading with code_source'
        ' auto, else the codes.',
        choices=tuple(each.value for each in PathSource), read_only=True)
    speed: float = parameter(
        0.0, 'Speed of the vehicle, if it is constant: odom is published in metres, and a path'
        ' from the heading is in metres. Takes a focal length; 0 if not known.', unit='m/s',
        minimum=0.0, maximum=MOST_SPEED, read_only=True, group=Group.VEHICLE)
    use_speed_topic: bool = parameter(
        False, 'Whether the speed is taken from the topic speed, for the same purpose.',
        read_only=True, group=Group.VEHICLE)
    speed_type: str = parameter(
        SpeedType.TWIST.value, 'What comes on the topic speed: a TwistStamped, a'
        ' TwistWithCovarianceStamped or an Odometry. A replay takes whichever the bag has.',
        choices=tuple(each.value for each in SpeedType), read_only=True, group=Group.VEHICLE)
    max_path_poses: int = parameter(
        1000, 'Poses of the published path: corner points, oldest dropped first, and the tip; of a'
        ' path from the heading places of the whole way, thinned.',
        minimum=2, maximum=100_000, read_only=True)
    path_rate: float = parameter(
        5.0, 'The path is published at most this often, and only when it has changed.',
        unit='Hz', minimum=0.1, maximum=100.0, read_only=True)
    chain_code_runs: int = parameter(
        50, 'Runs of each code that the chain code text shows, the newest ones.',
        minimum=1, maximum=1000)
    output_dir: str = parameter(
        '', 'Folder that ~/save and record_shifts write to; where it is empty, nothing is ever'
        ' written.', read_only=True, group=Group.VEHICLE)
    record_shifts: bool = parameter(
        False, 'Whether a row per pair of images is written to output_dir.', read_only=True,
        group=Group.VEHICLE)
    publish_tf: bool = parameter(
        False, 'Whether the transform from frame_id to child_frame_id is published on /tf (needs'
        ' tf2_msgs).', read_only=True, group=Group.VEHICLE)
    child_frame_id: str = parameter(
        'base_link', "The vehicle's frame, for publish_tf and the odometry.", group=Group.VEHICLE)
    max_runs: int = parameter(
        100_000, 'Runs of each code that the node keeps; the totals count all of them.',
        minimum=1000, maximum=10_000_000, read_only=True)

    def __post_init__(self) -> None:
        """Check every value against its declaration."""
        for spec in specs():
            spec.check(getattr(self, spec.name))
        for side in ('rows', 'columns'):
            begin, end = getattr(self, f'{side}_from'), getattr(self, f'{side}_to')
            if begin >= end:
                raise ParameterError(
                    f'parameters {side}_from and {side}_to are {begin} and {end}: the first has'
                    ' to be smaller')
        for name in ('frame_id', 'child_frame_id'):
            frame = getattr(self, name)
            if not frame or frame.startswith('/') or frame != frame.strip():
                raise ParameterError(
                    f'parameter {name!r} is {frame!r}: it takes the name of a frame, without a'
                    ' slash in front')
        if self.frame_id == self.child_frame_id and (self.publish_tf or self.metric):
            raise ParameterError(
                f"parameters 'frame_id' and 'child_frame_id' are both {self.frame_id!r}: the frame"
                ' that the vehicle moves in and its own take two names')
        if 0 < self.hfov_deg < LEAST_HFOV_DEG:
            raise ParameterError(
                f"parameter 'hfov_deg' is {self.hfov_deg}: it takes {LEAST_HFOV_DEG} or more, or 0"
                ' where it is not known')
        if 0 < self.code_step < LEAST_STEP:
            raise ParameterError(
                f"parameter 'code_step' is {self.code_step}: it takes {LEAST_STEP} or more, or 0"
                ' for no links')
        try:
            self._lens()
        except ValueError as error:
            raise ParameterError(f'the parameters of the camera do not go together: {error}') \
                from None
        if self.connectivity == 8 and self.codes_from is not CodeSource.HEADING:
            raise ParameterError(
                "parameter 'connectivity' is 8: it takes code_source heading, as shift and turns"
                ' tell right angles only')
        if self.speed > 0 and self.use_speed_topic:
            raise ParameterError(
                "parameters 'speed' and 'use_speed_topic' are both set: the speed is either"
                ' constant or comes on the topic, give one of them')

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
                near = get_close_matches(name, known, n=1)
                hint = f'did you mean {near[0]!r}?' if near else f'known are {", ".join(known)}'
                raise ParameterError(f'there is no parameter {name!r}: {hint}')
        return replace(self, **cast('dict[str, Any]', dict(values)))

    @property
    def notices(self) -> tuple[str, ...]:
        """Return what whoever chose the values should know, a line each."""
        if not self.estimate_fov:
            return ()
        return (
            'estimate_fov is an old name: code_source auto, the default, learns the camera from'
            ' the drive by itself',)

    @property
    def codes_from(self) -> CodeSource:
        """Return what the codes are made from: a threshold asks for the paper's rule."""
        if self.code_source == CodeSource.AUTO.value and (
                self.threshold > 0 or self.threshold_deg_s > 0):
            return CodeSource.SHIFT
        return CodeSource(self.code_source)

    @property
    def codes_from_heading(self) -> bool:
        """Return whether the codes are made from heading or turns, and not from the shift."""
        return self.codes_from is not CodeSource.SHIFT

    @property
    def threshold_px(self) -> float:
        """Return T in pixels per frame."""
        return self.threshold or PAPER_THRESHOLD

    @property
    def drawn_from(self) -> PathSource:
        """Return what the path is drawn from, CODES or HEADING."""
        return self.estimator_settings().drawn_from

    @property
    def measures_heading(self) -> bool:
        """Return whether heading and turns are measured."""
        return self.estimator_settings().measures_heading

    @property
    def learns_camera(self) -> bool:
        """Return whether the camera is learned from the drive where nothing else tells it."""
        return self.estimator_settings().learns_lens

    @property
    def metric(self) -> bool:
        """Return whether a speed or the camera's height gives odometry in metres."""
        return self.speed > 0 or self.use_speed_topic or self.camera_height > 0

    @property
    def length_unit(self) -> LengthUnit:
        """Return what distances and links are in."""
        return self.estimator_settings().length_unit

    @property
    def path_in_metres(self) -> bool:
        """Return whether the drawn path is in metres, and not in camera heights or steps."""
        return self.metric and self.drawn_from is PathSource.HEADING

    @property
    def path_scale(self) -> float:
        """Return the metres that a unit of the path stands for."""
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
            # The tip is one of the poses.
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
