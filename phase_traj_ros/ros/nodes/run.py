# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs the node of the executable and returns its exit status."""

from collections.abc import Sequence
import sys
from threading import Event

from phase_traj_ros.errors import ParameterError, PhaseTrajError
from phase_traj_ros.parameters import NODE_NAME
from phase_traj_ros.ros.nodes.node import PhaseTrajNode
from phase_traj_ros.ros.spin import ros_context, spin
from phase_traj_ros.ros.startup.param_files import with_files_found
from rclpy.logging import get_logger
from rclpy.utilities import remove_ros_args

EXIT_OK = 0
EXIT_FAILURE = 2
_HELP = """\
usage: phase_traj_node [-h] [--ros-args ...]

Codes the trajectory of a vehicle from the images of its camera.

All options are ROS arguments, for example:

  ros2 run phase_traj_ros phase_traj_node --ros-args -r image:=/camera/image_raw -p threshold:=12.0
  ros2 run phase_traj_ros phase_traj_node --ros-args --params-file FILE --log-level debug

ros2 param describe prints the description of each parameter of a running node."""


def run(stop: Event, arguments: Sequence[str] | None) -> int:
    """Run the node until ``stop`` is set, or print the help; return the exit status."""
    if stop.is_set():
        return EXIT_OK
    try:
        given = with_files_found(sys.argv[1:] if arguments is None else arguments)
        with ros_context(given):
            others = remove_ros_args(given)
            if {'-h', '--help'}.intersection(others):
                print(_HELP)
                return EXIT_OK
            if others:
                hint = 'see --help'
                if ':=' in others[0]:
                    hint = ("assignments come after --ros-args, as in '--ros-args -p"
                            f" {others[0]}'")
                raise ParameterError(f'unknown argument {others[0]!r}: {hint}')
            if not spin(PhaseTrajNode, stop).has_saved:
                # Which is an error in the log already.
                return EXIT_FAILURE
    except PhaseTrajError as error:
        get_logger(NODE_NAME).fatal(str(error))
        return EXIT_FAILURE
    return EXIT_OK
