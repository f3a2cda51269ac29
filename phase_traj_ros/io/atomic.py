# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writing results whole or not at all."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
import shutil
import tempfile

from phase_traj_ros.errors import OutputError


@contextmanager
def output_directory(target: Path) -> Iterator[Path]:
    """
    Yield a folder to write results into; move them to ``target`` when all are written.

    The folder lies inside ``target``, which is made if absent, so that an output that cannot be
    written is found out before the work and not after it. Each file or folder takes its place by
    a rename. If anything is raised, the folder is removed again, and what was made for it, too.

    Raises
    ------
    OutputError
        The results cannot be written.

    """
    made = _first_missing(target)
    try:
        target.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix='.phase_traj-', dir=target))
    except OSError as error:
        _remove(made)
        raise _output_error(target, error) from None
    try:
        yield staging
        for path in sorted(staging.iterdir()):
            if path.is_dir():  # a rename replaces a file, but no folder that holds something
                shutil.rmtree(target / path.name, ignore_errors=True)
            path.replace(target / path.name)
    except OSError as error:
        _remove(made)
        raise _output_error(target, error) from None
    except BaseException:
        _remove(made)
        raise
    finally:
        _remove(staging)


@contextmanager
def output_file(target: Path) -> Iterator[Path]:
    """
    Yield a path to write to; rename it to ``target`` when it is written, or remove it.

    Raises
    ------
    OutputError
        The file cannot be written.

    """
    if target.is_dir():
        raise OutputError(f'cannot write {target}: it is a directory')
    with output_directory(target.parent) as staging:
        yield staging / target.name


def _first_missing(path: Path) -> Path | None:
    """Return the topmost folder that has to be made for ``path``."""
    missing = [folder for folder in (path, *path.parents) if not folder.exists()]
    return missing[-1] if missing else None


def _remove(folder: Path | None) -> None:
    if folder is not None:
        shutil.rmtree(folder, ignore_errors=True)


def _output_error(target: Path, error: OSError) -> OutputError:
    reason = error.strerror or str(error)
    return OutputError(f'cannot write to {target}: {reason}: choose another place')
