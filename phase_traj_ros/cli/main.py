# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Entry point of the program ``phase_traj``."""

from collections.abc import Sequence
import os
import sys

from phase_traj_ros.errors import PhaseTrajError

EXIT_OK = 0
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130

# Broken videos and images are reported in one line by this program. Without these settings, the
# libraries of OpenCV would add their own messages. They read them when they are loaded.
_QUIET = {
    'OPENCV_LOG_LEVEL': 'OFF',
    'OPENCV_FFMPEG_LOGLEVEL': '-8',
    'OPENCV_VIDEOIO_DEBUG': '0',
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit status."""
    for name, value in _QUIET.items():
        os.environ.setdefault(name, value)
    # OpenCV reads the settings when it is loaded, and these modules load it.
    try:
        from phase_traj_ros.cli.program import program_parser
    except ModuleNotFoundError as error:
        print(
            f'phase_traj: error: the Python package {error.name} is missing: install'
            ' python3-opencv, python3-numpy and python3-yaml (apt), or install'
            ' phase_traj_ros with pip, which brings them', file=sys.stderr)
        return EXIT_BAD_INPUT

    options = program_parser().parse_args(arguments)
    try:
        status: int | None = options.run(options)
    except PhaseTrajError as error:
        print(f'phase_traj: error: {error}', file=sys.stderr)
        return EXIT_BAD_INPUT
    except BrokenPipeError:
        # The reader has closed the pipe. Nothing more must be written on exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_OK
    except KeyboardInterrupt:
        print('phase_traj: interrupted', file=sys.stderr)
        return EXIT_INTERRUPTED
    return EXIT_OK if status is None else status


if __name__ == '__main__':
    sys.exit(main())
