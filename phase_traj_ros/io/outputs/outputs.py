# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The owner of all outputs of a run: it replaces neither inputs nor files of someone else."""

from collections.abc import Collection, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, ExitStack, suppress
from dataclasses import dataclass, field
import fcntl
from itertools import chain
import os
from pathlib import Path
import shutil
import tempfile

from phase_traj_ros.errors import ForeignFileError, OutputError
from phase_traj_ros.io.outputs.commit import commit, Move, uninterrupted, writing_to
from phase_traj_ros.io.outputs.manifest import MANIFEST, Manifest

STAGING = '.phase_traj-'
"""Beginning of the names of the folders for unfinished outputs."""


@dataclass(frozen=True, slots=True)
class _Staged:
    """An output that is being made."""

    folder: Path
    """Folder of the output, without symbolic links."""
    made: Path
    """Folder of the files and folders that are made, in a hidden one in ``folder``."""
    manifest: Manifest | None = None
    """What is there from earlier runs; None for a single file."""
    adds: bool = False


@dataclass(slots=True)
class Outputs(AbstractContextManager['Outputs']):
    """
    The outputs of a run: made in hidden folders, and moved to their places as a set on exit.

    As a context manager, it moves all outputs to their places at the end of the block, or none
    of them: after an exception, also that of a signal, everything is as before. Only files that
    an earlier run wrote are replaced or removed. A file that the caller names is replaced, unless
    it is an input. A folder gets a manifest of what was written.
    """

    inputs: Collection[Path] = ()
    """Files and folders that the run reads: no output may be one of them or lie in one."""
    force: bool = False
    """Whether files in output folders are replaced that no earlier run wrote."""
    _staged: list[_Staged] = field(default_factory=list)
    _cleanup: ExitStack = field(default_factory=ExitStack)

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        with uninterrupted(), self._cleanup:
            if kind is None:
                commit([move for each in self._staged for move in self._moves(each)])

    def directory(self, target: Path, *, names: Collection[str] = (), adds: bool = False) -> Path:
        """
        Return a folder in which the files of the output folder ``target`` are to be made.

        Parameters
        ----------
        target
            The output folder. It is created if absent.
        names
            Names of the files that may be written.
        adds
            Whether the files complete the results that are there. Otherwise they replace them,
            and what else an earlier run wrote is removed.

        Raises
        ------
        OutputError
            The folder cannot be written, is an input or lies in one, or contains a file of one of
            the names that no earlier run wrote.

        """
        manifest = check_directory(target, names=names, inputs=self.inputs, force=self.force)
        return self._stage(target, manifest.folder, manifest, adds=adds)

    def file(self, target: Path) -> Path:
        """
        Return the path at which the output file ``target`` is to be made.

        Raises
        ------
        OutputError
            The file cannot be written, is an input or lies in one, or is a folder or a device.

        """
        with writing_to(target):
            place = Path(os.path.realpath(target))
            if target.is_dir():
                raise OutputError(f'cannot write {target}: it is a directory')
            if target.exists() and not target.is_file():
                raise OutputError(
                    f'cannot write {target}: it is a device or a pipe, not a file: choose'
                    ' another place')
            _refuse_inputs(place, target, self.inputs)
        return self._stage(target, place.parent) / place.name

    def _stage(
        self, target: Path, folder: Path, manifest: Manifest | None = None, *,
        adds: bool = False,
    ) -> Path:
        with uninterrupted(), writing_to(target):
            missing = [each for each in (folder, *folder.parents) if not each.exists()]
            for each in reversed(missing):
                each.mkdir(exist_ok=True)
                self._cleanup.callback(_remove_if_empty, each)
            remove_abandoned(folder)
            staging = Path(tempfile.mkdtemp(prefix=STAGING, dir=folder))
            self._cleanup.callback(shutil.rmtree, staging, ignore_errors=True)
            # Tells other runs that this one lives.
            lock = os.open(staging, os.O_RDONLY)
            self._cleanup.callback(os.close, lock)
            with suppress(OSError):  # Not every file system has locks.
                fcntl.flock(lock, fcntl.LOCK_SH)
            made = staging / 'made'
            self._staged.append(_Staged(folder, made, manifest, adds))
            made.mkdir()
            return made

    def _moves(self, each: _Staged) -> Iterator[Move]:
        with writing_to(each.folder):
            made = sorted(each.made.iterdir())
            removed: list[str] = []
            if each.manifest is not None:
                for path in made:
                    _refuse_foreign(each.manifest, path.name, force=self.force)
                # A named file in the folder belongs to its results.
                results = [*made, *chain.from_iterable(
                    other.made.iterdir() for other in self._staged
                    if other.manifest is None and other.folder == each.folder)]
                if not each.adds:
                    names = {MANIFEST, *(path.name for path in results)}
                    removed = [
                        name for name in each.manifest.owned
                        if name not in names and not _is_input(each.folder / name, self.inputs)]
                made.append(each.made.with_name(MANIFEST))
                each.manifest.followed_by(results, adds=each.adds).write(made[-1])
            aside = each.made.with_name('aside')
            aside.mkdir()
            for path in made:
                yield Move(path, each.folder / path.name, aside / path.name)
            for name in removed:
                yield Move(None, each.folder / name, aside / name)


@contextmanager
def output_file(target: Path, *, inputs: Collection[Path] = ()) -> Iterator[Path]:
    """
    Yield a path to write to; rename it to ``target`` after writing, or remove it on error.

    Raises
    ------
    OutputError
        The file cannot be written, or is one of the inputs.

    """
    with writing_to(target), Outputs(inputs=inputs) as outputs:
        yield outputs.file(target)


@contextmanager
def output_directory(
    target: Path, *, names: Collection[str] = (), adds: bool = False,
    inputs: Collection[Path] = (), force: bool = False,
) -> Iterator[Path]:
    """
    Yield a folder to write results into; move them to ``target`` when all are written.

    See ``Outputs.directory``.

    Raises
    ------
    OutputError
        The results cannot be written.

    """
    with writing_to(target), Outputs(inputs=inputs, force=force) as outputs:
        yield outputs.directory(target, names=names, adds=adds)


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
        _refuse_inputs(folder, target, inputs)
        manifest = Manifest.of(folder)
        for name in (*names, MANIFEST):
            if _is_input(folder / name, inputs):
                raise OutputError(f'{target / name} is an input: choose another output')
            _refuse_foreign(manifest, name, force=force)
        return manifest


def remove_abandoned(folder: Path) -> None:
    """Remove what killed runs left in a folder, unless earlier results were moved into it."""
    for staging in folder.glob(f'{STAGING}*'):
        with suppress(OSError):
            lock = os.open(staging, os.O_RDONLY)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # What a run makes after it has locked the folder.
                if (staging / 'made').is_dir() and not any(staging.glob('aside/*')):
                    shutil.rmtree(staging)
            finally:
                os.close(lock)


def _remove_if_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()


def _refuse_inputs(place: Path, target: Path, inputs: Collection[Path]) -> None:
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


def _is_input(path: Path, inputs: Iterable[Path]) -> bool:
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


def _refuse_foreign(manifest: Manifest, name: str, *, force: bool) -> None:
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
