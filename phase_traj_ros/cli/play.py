# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj play``: a recording on real topics."""

from argparse import Namespace, REMAINDER
from collections.abc import Iterator
from contextlib import closing
import math
import sys
from typing import Any

from phase_traj_ros.cli.options import add_command, add_source, SOURCE_HELP, source_of
from phase_traj_ros.cli.progress import progress
from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.errors import (
    CalibrationError,
    MissingDependencyError,
    ParameterError,
    SourceError,
)
from phase_traj_ros.io.sources.base import Frame, FrameSource
from phase_traj_ros.io.sources.prefetch import prefetch

_EPILOG = f"""
{SOURCE_HELP}
The frames are published as mono8 or mono16 sensor_msgs/Image with their own stamps, which also
go out on /clock. Where SOURCE says what its camera is like, so does camera_info beside the images.
For a live run that loses no frame, start the node with the matching quality
of service (in a namespace, put the full topic name in the place of /image):

  ros2 run phase_traj_ros phase_traj_node --ros-args \\
    -p qos_overrides./image.subscription.reliability:=reliable \\
    -p qos_overrides./image.subscription.history:=keep_all
  ros2 run phase_traj_ros phase_traj play SOURCE --lossless
"""


def add_parser(commands: Any) -> None:
    """Add the command to the parser."""
    parser = add_command(
        commands, 'play', summary='publish a recording on real topics, with its stamps',
        epilog=_EPILOG)
    add_source(parser)
    parser.add_argument(
        '--rate', metavar='R', type=float, default=1.0,
        help='play R times as fast as recorded (default 1)')
    parser.add_argument('--loop', action='store_true', help='begin again at the end')
    parser.add_argument(
        '--lossless', action='store_true',
        help='publish reliably with KEEP_ALL, begin when somebody has subscribed, and end when'
             ' everything has been received')
    parser.add_argument(
        '--image-topic', metavar='NAME', default='image', help='publish here (default: image)')
    parser.add_argument(
        '--wait', metavar='S', type=float, default=30.0,
        help='seconds to wait for a subscriber with --lossless (default 30)')
    parser.add_argument(
        '--ros-args', nargs=REMAINDER, default=[], metavar='...',
        help='arguments for ROS, such as -r __ns:=/front; they come last')
    parser.set_defaults(run=run)


def run(options: Namespace) -> None:
    """Run the command."""
    if not (math.isfinite(options.rate) and options.rate > 0):
        raise ParameterError(f'--rate is {options.rate}: give a finite number above 0')
    if not options.wait >= 0:
        raise ParameterError(f'--wait is {options.wait}: give a number of seconds, 0 or more')
    try:
        from phase_traj_ros.ros.playback.player import FramePlayer
        from phase_traj_ros.ros.spin import ros_context
    except ImportError as error:
        raise MissingDependencyError(
            f'playing needs rclpy ({error}): source a ROS 2 installation, or install'
            ' phase_traj_ros[ros]') from None
    with source_of(options) as source, ros_context(['--ros-args', *options.ros_args]) as stop:
        player = FramePlayer(
            topic=options.image_topic, lossless=options.lossless,
            camera=_camera_of(source, rectified=False),
            rectified=_camera_of(source, rectified=True))
        try:
            if options.lossless:
                player.wait_for_subscriber(stop, options.wait)
            total = None if options.loop else source.frame_count
            with closing(prefetch(_frames(source, loop=options.loop))) as frames:
                published = player.play(
                    progress(frames, total=total, title=options.source.name), stop,
                    rate=options.rate)
            if not stop.is_set():
                player.wait_for_acknowledgement()
        finally:
            player.destroy_node()
    print(f'published {published} frames')


def _camera_of(source: FrameSource, *, rectified: bool) -> CameraModel | None:
    """Return the calibration, if there is one: a bag can be played without, too."""
    try:
        return source.camera(rectified=rectified)
    except (CalibrationError, SourceError) as error:
        if not rectified:
            print(f'warning: no camera_info is published: {error}', file=sys.stderr)
        return None


def _frames(source: FrameSource, *, loop: bool) -> Iterator[Frame]:
    yield from source
    while loop:
        yield from source
