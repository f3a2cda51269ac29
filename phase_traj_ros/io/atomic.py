# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writes results completely or not at all."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
import shutil
import tempfile

from phase_traj_ros.errors import OutputError


@contextmanager
def output_directory(target: Path, *, obsolete: Iterable[str] = ()) -> Iterator[Path]:
    """
    Yield a folder to write results into; move them to ``target`` when all are written.

    The folder is inside ``target``, which is created if absent. So an output that cannot be
    written is reported before the work and not after it. Each file or folder is moved by a
    rename. After an error the folder is removed, and so are the folders that were created for it,
    unless another program has written into them meanwhile.

    Parameters
    ----------
    target
        Folder of the results.
    obsolete
        Names of files that an earlier run may have left in ``target``. They are removed when the
        results are moved, unless they have been written again.

    Raises
    ------
    OutputError
        The results cannot be written.

    """
    with writing_to(target), _results_for(target, obsolete) as staging:
        yield staging


@contextmanager
def output_file(target: Path) -> Iterator[Path]:
    """
    Yield a path to write to; rename it to ``target`` after writing, or remove it on error.

    Raises
    ------
    OutputError
        The file cannot be written.

    """
    if target.is_dir():
        raise OutputError(f'cannot write {target}: it is a directory')
    with writing_to(target), _results_for(target.parent) as staging:
        yield staging / target.name


@contextmanager
def writing_to(target: Path) -> Iterator[None]:
    """
    Convert errors of the operating system to an OutputError that names ``target``.

    Raises
    ------
    OutputError
        An operation of the operating system failed.

    """
    try:
        yield
    except OSError as error:
        raise OutputError(
            f'cannot write to {target}: {error.strerror or error}: choose another place') from None


@contextmanager
def _results_for(target: Path, obsolete: Iterable[str] = ()) -> Iterator[Path]:
    with _made(target), _staging(target) as staging:
        yield staging
        _commit(staging, target, obsolete)


@contextmanager
def _made(target: Path) -> Iterator[None]:
    """Create a folder and its parents; after an error, remove the created ones if empty."""
    missing = [folder for folder in (target, *target.parents) if not folder.exists()]
    try:
        target.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        # Bottom up, as long as they are empty.
        with suppress(OSError):
            for folder in missing:
                folder.rmdir()
        raise


@contextmanager
def _staging(target: Path) -> Iterator[Path]:
    """Create a folder in ``target``; remove it with its content afterwards."""
    staging = Path(tempfile.mkdtemp(prefix='.phase_traj-', dir=target))
    try:
        yield staging
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _commit(staging: Path, target: Path, obsolete: Iterable[str]) -> None:
    written = sorted(staging.iterdir())
    for path in written:
        if path.is_dir():  # a rename replaces a file, but not a folder with content
            shutil.rmtree(target / path.name, ignore_errors=True)
        path.replace(target / path.name)
    for name in set(obsolete) - {path.name for path in written}:
        (target / name).unlink(missing_ok=True)
