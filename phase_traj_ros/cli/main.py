# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Entry point of the program ``phase_traj``."""

from argparse import Action, ArgumentParser, Namespace
from collections.abc import Sequence
import os
import sys
from typing import NoReturn

import phase_traj_ros
from phase_traj_ros.errors import PhaseTrajError

EXIT_OK = 0
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130

# Broken videos and pictures are reported in one line of our own; the libraries under OpenCV
# would add theirs. They read these when they are loaded.
_QUIET = {
    'OPENCV_LOG_LEVEL': 'OFF',
    'OPENCV_FFMPEG_LOGLEVEL': '-8',
    'OPENCV_VIDEOIO_DEBUG': '0',
}


class _Parser(ArgumentParser):
    """Reports a wrong call in one line, as all other errors are."""

    def error(self, message: str) -> NoReturn:
        self.exit(EXIT_BAD_INPUT, f'{self.prog}: error: {message}: see {self.prog} --help\n')


class _Version(Action):
    """Tells the version, and what of the installation makes results and speed."""

    def __call__(
        self, parser: ArgumentParser, namespace: Namespace, values: object,
        option_string: str | None = None,
    ) -> NoReturn:
        from phase_traj_ros.core.correlation.transforms import (
            find_transform, transform_hint, TransformLibrary)
        print(f'phase_traj_ros {phase_traj_ros.__version__}')
        print(f'transforms: {find_transform(TransformLibrary.AUTO).name}')
        hint = transform_hint(TransformLibrary.AUTO)
        if hint:
            print(hint)
        parser.exit(EXIT_OK)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit status."""
    for name, value in _QUIET.items():
        os.environ.setdefault(name, value)
    # OpenCV reads the above when it is loaded, and these modules load it.
    try:
        from phase_traj_ros.cli import calibrate, demo, evaluate, inspect_frames, play, replay
    except ModuleNotFoundError as error:
        print(
            f'phase_traj: error: the Python package {error.name} is missing: install'
            ' python3-opencv, python3-numpy and python3-yaml (apt), or'
            ' phase_traj_ros[offline] (pip)', file=sys.stderr)
        return EXIT_BAD_INPUT

    parser = _Parser(
        prog='phase_traj', description='Chain codes of a trajectory from a forward camera.')
    parser.add_argument(
        '--version', action=_Version, nargs=0,
        help='show the version, and the library of the transforms, and exit')
    commands = parser.add_subparsers(title='commands', required=True, metavar='COMMAND')
    for command in (replay, evaluate, calibrate, play, inspect_frames, demo):
        command.add_parser(commands)
    options = parser.parse_args(arguments)
    try:
        status: int | None = options.run(options)
    except PhaseTrajError as error:
        print(f'phase_traj: error: {error}', file=sys.stderr)
        return EXIT_BAD_INPUT
    except BrokenPipeError:
        # Whoever read the output has seen enough; nothing more is to be written at the end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_OK
    except KeyboardInterrupt:
        print('phase_traj: interrupted', file=sys.stderr)
        return EXIT_INTERRUPTED
    return EXIT_OK if status is None else status


if __name__ == '__main__':
    sys.exit(main())
