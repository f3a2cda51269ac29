# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Checks the arguments of an executable: ROS arguments and ``--help`` only."""

from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Sequence
from typing import NoReturn

from phase_traj_ros.errors import ParameterError
from rclpy.utilities import remove_ros_args

_EPILOG = """\
All options are ROS arguments, for example:

  ros2 run phase_traj_ros {program} --ros-args -r image:=/camera/image_raw -p threshold:=12.0
  ros2 run phase_traj_ros {program} --ros-args --params-file FILE --log-level debug

ros2 param describe prints the description of each parameter of a running node.
"""


class _Parser(ArgumentParser):

    def error(self, message: str) -> NoReturn:
        raise ParameterError(message)


def check_arguments(program: str, description: str, arguments: Sequence[str]) -> None:
    """
    Accept ROS arguments; for ``--help``, print the help and exit with status 0.

    Parameters
    ----------
    program
        Name of the executable.
    description
        Purpose of the executable, in one sentence.
    arguments
        Arguments after the name of the program.

    Raises
    ------
    ParameterError
        An argument is not a ROS argument.

    """
    parser = _Parser(
        prog=program, usage=f'{program} [-h] [--ros-args ...]', description=description,
        epilog=_EPILOG.format(program=program), formatter_class=RawDescriptionHelpFormatter)
    _, unknown = parser.parse_known_args(remove_ros_args(list(arguments)))
    if not unknown:
        return
    hint = 'see --help'
    if ':=' in unknown[0]:
        hint = f"assignments come after --ros-args, as in '--ros-args -p {unknown[0]}'"
    raise ParameterError(f'unknown argument {unknown[0]!r}: {hint}')
