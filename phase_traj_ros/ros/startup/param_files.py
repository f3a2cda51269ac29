# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Checks that the parameter files given to a node have parameters for it."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
import sys

from phase_traj_ros.io.params_file import values_for
from rclpy.node import Node

_FLAG = '--params-file'


def param_files(arguments: Sequence[str]) -> list[Path]:
    """Return the parameter files given in the ROS arguments."""
    return [Path(value) for flag, value in pairwise(arguments) if flag == _FLAG]


def check_param_files(node: Node, arguments: Sequence[str] | None = None) -> list[Path]:
    """
    Return the parameter files with which ``node`` was started.

    Raises
    ------
    ParameterError
        A file has no parameters for this node, which would run with the defaults.

    """
    files = param_files(sys.argv[1:] if arguments is None else arguments)
    full_name = node.get_fully_qualified_name()
    for file in files:
        values_for(file, full_name)
    return files
