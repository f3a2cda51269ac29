# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What no output may replace: inputs of the run, and files of someone else."""

from collections.abc import Collection, Iterable
from contextlib import suppress
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
        folder = Path(os.path.realpath(target))
        refuse_inputs(folder, target, inputs)
        manifest = Manifest.of(folder)
        for name in (*names, MANIFEST):
            if is_input(folder / name, inputs):
                raise OutputError(f'{target / name} is an input: choose another output')
            refuse_foreign(manifest, name, force=force)
        return manifest


def refuse_inputs(place: Path, target: Path, inputs: Collection[Path]) -> None:
    """Raise OutputError if ``target``, with the real path ``place``, is or lies in an input."""
    links = (link for each in inputs if each.is_dir() for link in each.iterdir())
    # The pictures of a sequence may be elsewhere.
    read = _identities([*inputs, *(link for link in links if link.is_symlink())])
    if read & _identities([place]):
        raise OutputError(f'{target} is an input: choose another output')
    for folder in place.parents:
        if read & _identities([folder]):
            raise OutputError(
                f'{target} lies in the input {folder}, and would become a part of it: choose'
                ' another output')


def is_input(path: Path, inputs: Iterable[Path]) -> bool:
    """Return whether a file or folder is one of the inputs, under whatever name."""
    return bool(_identities([path]) & _identities(inputs))


def _identities(paths: Iterable[Path]) -> set[tuple[int, int]]:
    """Return what tells files and folders from others, whatever their names."""
    found = set()
    for path in paths:
        with suppress(OSError):  # Of what is absent, there is nothing to tell.
            status = path.stat()
            found.add((status.st_dev, status.st_ino))
    return found


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
