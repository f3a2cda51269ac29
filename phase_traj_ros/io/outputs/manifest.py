# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The list of a folder's files that this package wrote."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
import hashlib
import json
from pathlib import Path
from typing import Any, Final

import phase_traj_ros

MANIFEST: Final = 'manifest.json'

_PROGRAM = 'phase_traj_ros'


@dataclass(frozen=True, slots=True)
class Manifest:
    """
    The files of a folder that earlier runs wrote there.

    A listed file that has other contents by now was changed by someone else and is not owned.
    """

    folder: Path
    digests: Mapping[str, str] = field(default_factory=dict)
    """SHA-256 of each file by its path in the folder, in hexadecimal."""

    @classmethod
    def of(cls, folder: Path) -> Manifest:
        """Read the manifest of a folder; without one, the folder owns no files."""
        found = _content(folder / MANIFEST)
        listed = found.get('files')
        if found.get('program') != _PROGRAM or not isinstance(listed, dict):
            return cls(folder)
        digests = {name: found for name, found in listed.items() if isinstance(found, str)}
        return cls(folder, {**digests, **_digests(folder, (MANIFEST,))})

    @classmethod
    def made_of(cls, folder: Path, staged: Mapping[str, Path]) -> Manifest:
        """Return the manifest of staged files and folders, by their names in ``folder``."""
        return cls(folder, {
            f'{name}{inside}': _digest(path)
            for name, top in staged.items() for inside, path in _files_below(top)})

    def owns(self, name: str) -> bool:
        """Return whether a file, or all files of a folder, are still as they were written."""
        path = self.folder / name
        if path.is_dir() and not path.is_symlink():
            files = list(_files_below(path))
            return bool(files) and all(
                self._owns_file(f'{name}{inside}') for inside, _ in files)
        return self._owns_file(name)

    @property
    def owned(self) -> tuple[str, ...]:
        """Return the names of the owned files and folders at the top of the folder."""
        tops = dict.fromkeys(name.split('/')[0] for name in self.digests)
        return tuple(
            name for name in tops if (self.folder / name).exists() and self.owns(name))

    def merged(self, other: Manifest) -> Manifest:
        """Return this manifest with the entries of another one, which take precedence."""
        return Manifest(self.folder, {**self.digests, **other.digests})

    def without(self, names: Iterable[str]) -> Manifest:
        """Return the manifest without some files and folders at the top of the folder."""
        gone = set(names)
        return Manifest(self.folder, {
            name: found for name, found in self.digests.items() if name.split('/')[0] not in gone})

    def write(self, path: Path) -> None:
        """Write the manifest as JSON."""
        files = {name: found for name, found in sorted(self.digests.items()) if name != MANIFEST}
        path.write_text(json.dumps({
            'program': _PROGRAM, 'version': phase_traj_ros.__version__, 'files': files,
        }, indent=2) + '\n', encoding='utf-8')

    def _owns_file(self, name: str) -> bool:
        return name in self.digests and (
            _digests(self.folder, (name,)) == {name: self.digests[name]})


def _digest(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open('rb') as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def _digests(folder: Path, names: Iterable[str]) -> dict[str, str]:
    """Return the digests of those that are regular files, by name."""
    paths = {name: folder / name for name in names}
    return {
        name: _digest(path) for name, path in paths.items()
        if path.is_file() and not path.is_symlink()}


def _files_below(path: Path) -> Iterator[tuple[str, Path]]:
    """Yield what is to be appended to the name of a file or folder, and the file."""
    if not path.is_dir():
        yield '', path
        return
    for file in sorted(path.rglob('*')):
        if file.is_symlink() or not file.is_dir():
            yield f'/{file.relative_to(path).as_posix()}', file


def _content(path: Path) -> dict[str, Any]:
    """Return the JSON object of a file; empty if it holds none."""
    try:
        found = json.loads(path.read_text(encoding='utf-8')) if path.is_file() else None
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}
