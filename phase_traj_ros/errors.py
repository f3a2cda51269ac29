# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
What can go wrong, one class for each kind of cause.

Every message says in one line what was wrong and what to do about it: the command line prints
it as it is, and the node logs it as it is.
"""

import sys


class PhaseTrajError(Exception):
    """Base class of all errors this package raises on purpose."""


class FrameError(PhaseTrajError, ValueError):
    """A frame cannot be used: wrong shape, type, size or encoding, or broken data."""


class ParameterError(PhaseTrajError, ValueError):
    """A parameter is unknown, of the wrong type or out of its range."""


class CalibrationError(PhaseTrajError):
    """The calibration of a camera cannot be used."""


class SourceError(PhaseTrajError):
    """A source of frames cannot be opened or read."""


class OutputError(PhaseTrajError):
    """A result cannot be written."""


class ResultError(PhaseTrajError):
    """A result is not what it has to be."""


class MissingDependencyError(PhaseTrajError, ImportError):
    """An optional dependency is needed for what was asked, and is not installed."""


def rosbags_missing(what: str, error: ImportError, *, instead: str = '') -> MissingDependencyError:
    """
    Return the error that says what to install, and for which interpreter.

    Parameters
    ----------
    what
        What needs it, as the beginning of a sentence.
    error
        What the import has said.
    instead
        What else would do, as a further sentence part.

    """
    # With ros2 run, the interpreter is the one that colcon has run with, whatever is activated.
    return MissingDependencyError(
        f'{what} needs the Python package rosbags, 0.11 or later ({error}): install it for the'
        f' interpreter that runs this, {sys.executable} -m pip install rosbags'
        f' (docs/how-to/ros.md says how, where that is the one of the system){instead}')
