# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs the node of an executable and returns its exit status."""

from collections.abc import Callable, Sequence
import sys
from threading import Event

from phase_traj_ros.errors import PhaseTrajError
from phase_traj_ros.parameters import NODE_NAME
from phase_traj_ros.ros.spin import ros_context, spin
from phase_traj_ros.ros.startup.arguments import check_arguments
from phase_traj_ros.ros.startup.param_files import with_files_found
from rclpy.logging import get_logger
from rclpy.node import Node

EXIT_OK = 0
EXIT_BAD_INPUT = 2


def run(
    make_node: Callable[[], Node], stop: Event, arguments: Sequence[str] | None, *,
    program: str, description: str,
) -> int:
    """Run the node until ``stop`` is set; return the exit status."""
    if stop.is_set():
        return EXIT_OK
    try:
        given = with_files_found(sys.argv[1:] if arguments is None else arguments)
        with ros_context(given):
            check_arguments(program, description, given)
            spin(make_node, stop)
    except PhaseTrajError as error:
        get_logger(NODE_NAME).fatal(str(error))
        return EXIT_BAD_INPUT
    return EXIT_OK
