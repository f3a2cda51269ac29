# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Entry point of the program ``phase_traj``."""

from collections.abc import Sequence
import os
import signal
import sys

from phase_traj_ros.cli import ending
from phase_traj_ros.cli.escaping import escaped, escaped_output
from phase_traj_ros.errors import ForeignFileError, PhaseTrajError

# Broken videos and images are reported in one line by this program. Without these settings, the
# libraries of OpenCV would add their own messages. They read them when they are loaded.
_QUIET = {
    'OPENCV_LOG_LEVEL': 'OFF',
    'OPENCV_FFMPEG_LOGLEVEL': '-8',
    'OPENCV_VIDEOIO_DEBUG': '0',
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit status."""
    ending.open_closed_streams()
    try:
        with escaped_output():
            return _status(arguments)
    finally:
        ending.write_error(sys.stderr)


def _status(arguments: Sequence[str] | None) -> int:
    for name, value in _QUIET.items():
        os.environ.setdefault(name, value)
    ending.handle_signals(ending.leave_at_once)
    try:
        # OpenCV reads the settings when it is loaded, and these modules load it.
        from phase_traj_ros.cli.program import program_parser
        ending.handle_signals(ending.raise_ended)
        options = program_parser().parse_args(arguments)
        status: int | None = options.run(options)
    except PhaseTrajError as error:
        hint = ', or replace it with --force' if isinstance(error, ForeignFileError) else ''
        status = _refused(f'{error}{hint}')
    except ModuleNotFoundError as error:
        package, ours = ((name or '').partition('.')[0] for name in (error.name, __package__))
        if package in ('', ours):
            raise
        status = _refused(
            f'the Python package {package} is missing: install python3-opencv, python3-numpy,'
            ' python3-yaml, python3-tqdm and python3-matplotlib (apt), or install phase_traj_ros'
            ' with pip, which brings them')
    except KeyboardInterrupt as error:
        # The process is ending: another Ctrl-C must not turn this into a failure.
        ending.handle_signals(signal.SIG_IGN)
        number = error.number if isinstance(error, ending.Ended) else signal.SIGINT
        ending.say(ending.line_of(number))
        status = ending.status_of(number)
    except SystemExit as end:
        # The parser has printed the help, or what is wrong with the call.
        status = end.code if isinstance(end.code, int) else 0
    except OSError as error:
        # An error of a file has its name; one without is of the standard output.
        if error.filename is None:
            ending.write_error(sys.stdout)
            return _unheard(error)
        status = _refused(f'{error.filename}: {error.strerror}')
    failed = ending.write_error(sys.stdout)
    return (status or 0) if failed is None else _unheard(failed)


def _unheard(error: OSError) -> int:
    """Tell that the output cannot be written; return the exit status."""
    if isinstance(error, BrokenPipeError):
        ending.say('phase_traj: the reader of the output has closed it')
        return ending.status_of(signal.SIGPIPE)
    return _refused(f'cannot write to the standard output: {error.strerror}')


def _refused(problem: str) -> int:
    """Tell why the work cannot be done; return the exit status."""
    ending.say(escaped(f'phase_traj: error: {problem}'))
    return ending.EXIT_BAD_INPUT


if __name__ == '__main__':
    sys.exit(main())
