# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The list of a folder's files that this package wrote."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
import hashlib
from itertools import chain
import json
from pathlib import Path

import phase_traj_ros

MANIFEST = 'manifest.json'


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
    def of(cls, folder: Path) -> 'Manifest':
        """Read the manifest of a folder; without one, the folder owns no files."""
        content: object = None
        path = folder / MANIFEST
        with suppress(OSError, ValueError, RecursionError):
            # A pipe of that name would never end.
            content = json.loads(path.read_text(encoding='utf-8')) if path.is_file() else None
        match content:
            case {'program': 'phase_traj_ros', 'files': dict(listed)}:
                return cls(folder, {**listed, MANIFEST: _digest(path)})
        return cls(folder)

    def owns(self, name: str) -> bool:
        """Return whether a file, or all files of a folder, are still as they were written."""
        digests = dict(_digests(self.folder / name))
        return (
            bool(digests) and all(digests.values()) and digests.items() <= self.digests.items())

    @property
    def owned(self) -> tuple[str, ...]:
        """Return the names of the owned files and folders at the top of the folder."""
        return tuple(filter(self.owns, dict.fromkeys(map(_top, self.digests))))

    def followed_by(self, made: Iterable[Path], *, adds: bool) -> 'Manifest':
        """Return the manifest with new files and folders, beside the others or alone."""
        names = {path.name for path in made}
        kept = {
            name: digest for name, digest in self.digests.items()
            if adds and _top(name) not in names}
        return Manifest(self.folder, kept | dict(chain.from_iterable(map(_digests, made))))

    def write(self, path: Path) -> None:
        """Write the manifest as JSON."""
        files = {name: found for name, found in sorted(self.digests.items()) if name != MANIFEST}
        path.write_text(json.dumps({
            'program': 'phase_traj_ros', 'version': phase_traj_ros.__version__, 'files': files,
        }, indent=2) + '\n', encoding='utf-8')


def _top(name: str) -> str:
    """Return the file or folder at the top that a file is or belongs to."""
    return name.partition('/')[0]


def _digests(top: Path) -> Iterator[tuple[str, str]]:
    """Yield a file, or the files below a folder: their names from there on, and digests."""
    inside = top.is_dir() and not top.is_symlink()
    for path in sorted(top.rglob('*')) if inside else [top]:
        if path.is_symlink() or not path.is_dir():
            yield path.relative_to(top.parent).as_posix(), _digest(path)


def _digest(path: Path) -> str:
    """Return the SHA-256 of a regular file; empty for anything else."""
    if path.is_symlink() or not path.is_file():
        return ''
    digest = hashlib.sha256()
    with path.open('rb') as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()
