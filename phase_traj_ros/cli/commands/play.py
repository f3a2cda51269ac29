# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj play``: publishes a recording on ROS topics."""

from argparse import ArgumentParser, Namespace, REMAINDER
from collections.abc import Iterator
from contextlib import closing
import math

from phase_traj_ros.cli.options import (
    add_source,
    Command,
    number,
    RCLPY_REMEDY,
    SOURCE_HELP,
    source_of,
)
from phase_traj_ros.cli.report import progress, warn
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.errors import CalibrationError, needing, OutputError, SourceError
from phase_traj_ros.io.sources.base import FrameSource, StampedFrame, UnreadableFrame
from phase_traj_ros.io.sources.prefetch import prefetch

_WAIT_S, _WAIT_LOSSLESS_S, _MOST_WAIT_S, _LINGER_S = 5.0, 30.0, 86400.0, 1.0
# As in ros2 bag play.
_CLOCK_HZ, _MOST_CLOCK_HZ = 40.0, 1000.0

_EPILOG = f"""
{SOURCE_HELP}
The frames are published as mono8, mono16 or 32FC1 sensor_msgs/Image with their own stamps. With
--clock, the time of the recording is published on /clock, which every node of the system with
use_sim_time follows. If SOURCE has a calibration, it is published as camera_info beside the
images. For a live run that loses no frame, start the node with the matching quality of service
(in a namespace, replace /image by the full topic name):

  ros2 run phase_traj_ros phase_traj_node --ros-args \\
    -p qos_overrides./image.subscription.reliability:=reliable \\
    -p qos_overrides./image.subscription.history:=keep_all
  ros2 run phase_traj_ros phase_traj play SOURCE --lossless
"""

COMMAND = Command(
    'play', summary='publish a recording on ROS topics, with its stamps',
    example='phase_traj play drive.mp4 --rate 2', epilog=_EPILOG)


def add_options(parser: ArgumentParser) -> None:
    """Add the arguments and options of the command."""
    add_source(parser)
    parser.add_argument(
        '--rate', metavar='R', default=1.0,
        type=number('a finite number above 0', lambda rate: 0.0 < rate < math.inf),
        help='play R times as fast as recorded (default 1)')
    parser.add_argument('--loop', action='store_true', help='start again at the end')
    parser.add_argument(
        '--lossless', action='store_true',
        help='publish reliably with KEEP_ALL, fail without a subscriber, and end when all'
             ' frames have been received')
    parser.add_argument(
        '--clock', metavar='HZ', nargs='?', const=_CLOCK_HZ,
        type=number(f'a number above 0, up to {_MOST_CLOCK_HZ:g}',
                    lambda rate: 0.0 < rate <= _MOST_CLOCK_HZ),
        help='publish the time of the recording on /clock, HZ times a second'
             f' ({_CLOCK_HZ:g} if HZ is not given)')
    parser.add_argument(
        '--image-topic', metavar='NAME', default='image',
        help='topic of the images (default: image)')
    parser.add_argument(
        '--wait', metavar='S',
        type=number(f'a number of seconds, 0 to {_MOST_WAIT_S:g}',
                    lambda seconds: 0.0 <= seconds <= _MOST_WAIT_S),
        help='longest time in seconds to wait for a subscriber before the first frame (default'
             f' {_WAIT_S:g}, with --lossless {_WAIT_LOSSLESS_S:g})')
    parser.add_argument(
        '--ros-args', nargs=REMAINDER, default=[], metavar='...',
        help='arguments for ROS, such as -r __ns:=/front; must be the last option')


def run(options: Namespace) -> None:
    """Run the command."""
    if options.wait is None:
        options.wait = _WAIT_LOSSLESS_S if options.lossless else _WAIT_S
    with needing('playing needs rclpy', RCLPY_REMEDY):
        from phase_traj_ros.ros.playback.player import FramePlayer
        from phase_traj_ros.ros.spin import names_explained, ros_context, spinning
        from phase_traj_ros.ros.startup.signals import stop_on_signals
    with (source_of(options, options.source) as source, stop_on_signals() as stop,
            ros_context(['--ros-args', *options.ros_args])):
        with names_explained():
            player = FramePlayer(
                topic=options.image_topic, lossless=options.lossless,
                camera=_camera_of(source, rectified=False),
                rectified=_camera_of(source, rectified=True), clock_hz=options.clock)
        with spinning(player):
            if not player.wait_for_subscribers(stop, options.wait):
                _nobody_listens(player.topic, options)
            total = None if options.loop else source.frame_count
            with closing(prefetch(_frames(source, loop=options.loop))) as frames:
                published = player.play(
                    progress(frames, total=total, title=options.source.name), stop,
                    rate=options.rate)
            if options.lossless and not stop.is_set():
                player.wait_for_acknowledgement(stop)
            # What is on its way is lost with the publisher.
            stop.wait(_LINGER_S)
    print(f'published {published} frames')
    if source.frames.problem is not None:
        warn(source.frames.problem)


def _nobody_listens(topic: str, options: Namespace) -> None:
    problem = (f'no subscriber to {topic} with a matching quality of service within'
               f' {options.wait:g} s: start the node, and remap its image to this topic')
    if options.lossless:
        raise OutputError(f'{problem}, and for --lossless set its qos_overrides to reliable')
    if options.wait > 0:
        warn(problem)


def _camera_of(source: FrameSource, *, rectified: bool) -> CameraModel | None:
    """Return the calibration, if there is one; a bag can also be played without."""
    try:
        return source.camera(rectified=rectified)
    except (CalibrationError, SourceError) as error:
        if not rectified:
            warn(f'no camera_info is published: {error}')
        return None


def _frames(source: FrameSource, *, loop: bool) -> Iterator[StampedFrame]:
    while True:
        usable = False
        for entry in source.entries():
            if isinstance(entry, UnreadableFrame):
                warn(f'skipped frame {entry.number}: {entry.reason}')
            else:
                usable = True
                yield entry
        if not usable:
            raise SourceError(f'{source.description}: no frame can be used')
        if not loop:
            return
