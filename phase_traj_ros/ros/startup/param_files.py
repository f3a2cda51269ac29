# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameter files of an executable: found by their names, and for which nodes they are."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
import sys

from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.params_file import find_params_file, values_for
from rclpy.node import Node

_FLAG = '--params-file'


def with_files_found(arguments: Sequence[str]) -> list[str]:
    """
    Return the arguments, in which each parameter file is given by its path.

    A parameter file may be given by the name of one in ``config/``.

    Raises
    ------
    ParameterError
        There is no such file.

    """
    return [
        str(find_params_file(value)) if flag == _FLAG else value
        for flag, value in pairwise(('', *arguments))]


def param_files_for(node: Node) -> tuple[list[Path], list[str]]:
    """
    Return the given parameter files that have parameters for ``node``, and warnings.

    A file for other nodes is usual, since a vehicle may have one file for all of them. There is a
    warning only if no file has parameters for this node, which then runs with the defaults.
    """
    own, warnings = [], []
    for path in [find_params_file(value) for flag, value in pairwise(sys.argv) if flag == _FLAG]:
        try:
            values_for(path, node.get_fully_qualified_name())
            own.append(path)
        except ParameterError as error:
            warnings.append(str(error))
    return own, [] if own else warnings
