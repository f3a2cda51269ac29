# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Errors of the package, one class for each kind of cause.

Every message states in one line what is wrong and what to do about it. The command line prints
it and the node logs it without change.
"""

from collections.abc import Iterator
from contextlib import contextmanager
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


class MapError(PhaseTrajError):
    """A road map cannot be read, or does not serve."""


class OutputError(PhaseTrajError):
    """A result cannot be written."""


class ForeignFileError(OutputError):
    """A file that this package did not write would be replaced, which only ``force`` allows."""


class ResultError(PhaseTrajError):
    """A result does not meet its requirements."""


class MissingDependencyError(PhaseTrajError, ImportError):
    """A requested feature needs an optional dependency that is not installed."""


def message_of(error: Exception) -> str:
    """Return the message of an error, after its class unless it is one of this package."""
    return str(error) if isinstance(error, PhaseTrajError) else f'{type(error).__name__}: {error}'


@contextmanager
def reading(path: object) -> Iterator[None]:
    """
    Convert errors of the operating system and of text to a SourceError that names ``path``.

    Raises
    ------
    SourceError
        The block could not read a file, or it is not a text file.

    """
    try:
        yield
    except OSError as error:
        raise SourceError(f'{path} cannot be read: {error.strerror or error}') from error
    except UnicodeError as error:
        raise SourceError(f'{path} cannot be read: it is not a text file') from error


@contextmanager
def needing(what: str, remedy: str) -> Iterator[None]:
    """
    Convert the error of an import to a MissingDependencyError: what is missing, and the remedy.

    Raises
    ------
    MissingDependencyError
        The block could not import a package.

    """
    try:
        yield
    except ImportError as error:
        raise MissingDependencyError(f'{what} ({error}): {remedy}') from None


def rosbags_missing(what: str, error: ImportError, *, instead: str = '') -> MissingDependencyError:
    """
    Return the error that names the package to install, and the interpreter to install it for.

    Parameters
    ----------
    what
        The feature that needs rosbags, as the beginning of a sentence.
    error
        The error of the import.
    instead
        An alternative, to append to the sentence.

    """
    # With ros2 run, this is the interpreter that colcon ran with, whatever environment is active.
    return MissingDependencyError(
        f'{what} needs the Python package rosbags, 0.11 or later ({error}): install it for the'
        f' interpreter that runs this, {sys.executable} -m pip install rosbags'
        f' (for the interpreter of the system, see docs/how-to/ros.md){instead}')
