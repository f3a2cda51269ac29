# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What no output may replace: inputs of the run, and files of someone else."""

from __future__ import annotations

from collections.abc import Collection, Iterable
import os
from pathlib import Path

from phase_traj_ros.errors import ForeignFileError, OutputError
from phase_traj_ros.io.outputs.commit import writing_to
from phase_traj_ros.io.outputs.manifest import MANIFEST, Manifest


def check_directory(
    target: Path, *, names: Iterable[str], inputs: Collection[Path] = (), force: bool = False,
) -> Manifest:
    """
    Check that files of these names may be written into the folder ``target``.

    Return what earlier runs wrote there.

    Raises
    ------
    OutputError
        The folder is an input or lies in one, or contains a file of one of the names that no
        earlier run wrote.

    """
    with writing_to(target):
        folder = real(target)
        refuse_inputs(folder, target, inputs)
        manifest = Manifest.of(folder)
        for name in (*names, MANIFEST):
            if is_input(folder / name, inputs):
                raise OutputError(f'{target / name} is an input: choose another output')
            refuse_foreign(manifest, name, force=force)
        return manifest


def real(target: Path) -> Path:
    """Return the absolute path without symbolic links; also of what does not exist."""
    return Path(os.path.realpath(target))


def refuse_inputs(place: Path, target: Path, inputs: Collection[Path]) -> None:
    """Raise OutputError if ``target``, with the real path ``place``, is or lies in an input."""
    read = _identities([*inputs, *(link for each in inputs for link in _links_in(each))])
    if _identity(place) in read:
        raise OutputError(f'{target} is an input: choose another output')
    for folder in place.parents:
        if _identity(folder) in read:
            raise OutputError(
                f'{target} lies in the input {folder}, and would become a part of it: choose'
                ' another output')


def is_input(path: Path, inputs: Iterable[Path]) -> bool:
    """Return whether a file or folder is one of the inputs, under whatever name."""
    return _identity(path) in _identities(inputs)


def _identities(paths: Iterable[Path]) -> set[tuple[int, int]]:
    return {found for found in map(_identity, paths) if found is not None}


def _identity(path: Path) -> tuple[int, int] | None:
    """Return what tells a file or folder from others; None if absent."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def _links_in(folder: Path) -> list[Path]:
    """Return the symbolic links in a folder; the pictures of a sequence may be elsewhere."""
    found = folder.iterdir() if folder.is_dir() else ()
    return [path for path in found if path.is_symlink()]


def refuse_foreign(manifest: Manifest, name: str, *, force: bool) -> None:
    """Raise ForeignFileError if no earlier run wrote the file, or OutputError for a folder."""
    path = manifest.folder / name
    if not os.path.lexists(path) or manifest.owns(name):
        return
    if path.is_dir() and not path.is_symlink():
        raise OutputError(
            f'{path} is a folder that no earlier run wrote: move it away, or choose another'
            ' output')
    if not force:
        raise ForeignFileError(
            f'{path} was not written by an earlier run, or was changed since: move it away, or'
            ' choose another output')
