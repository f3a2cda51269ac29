# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Writing results whole or not at all."""

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

    The folder lies inside ``target``, which is made if absent, so that an output that cannot be
    written is found out before the work and not after it. Each file or folder takes its place by
    a rename. If anything is raised, the folder is removed again, and so are the folders that were
    made for it, unless another program has written into them meanwhile.

    Parameters
    ----------
    target
        Where the results go.
    obsolete
        Names of files that older results may have left there. They are removed with the renames,
        unless they have been written anew.

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
    Yield a path to write to; rename it to ``target`` when it is written, or remove it.

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
    Name ``target`` as what cannot be written, where the system refuses something.

    Raises
    ------
    OutputError
        The system has refused something.

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
    """Make a folder and those above it; after a failure, remove those made that are empty."""
    missing = [folder for folder in (target, *target.parents) if not folder.exists()]
    try:
        target.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        # From the bottom up, as far as nothing is in them.
        with suppress(OSError):
            for folder in missing:
                folder.rmdir()
        raise


@contextmanager
def _staging(target: Path) -> Iterator[Path]:
    """Make a folder in ``target``, and remove it with all that is left in it."""
    staging = Path(tempfile.mkdtemp(prefix='.phase_traj-', dir=target))
    try:
        yield staging
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _commit(staging: Path, target: Path, obsolete: Iterable[str]) -> None:
    written = sorted(staging.iterdir())
    for path in written:
        if path.is_dir():  # a rename replaces a file, but no folder that holds something
            shutil.rmtree(target / path.name, ignore_errors=True)
        path.replace(target / path.name)
    for name in set(obsolete) - {path.name for path in written}:
        (target / name).unlink(missing_ok=True)
