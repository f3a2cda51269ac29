# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames from a folder of pictures, such as a sequence of the KITTI odometry dataset."""

from collections.abc import Generator
from decimal import Decimal
from functools import partial
from pathlib import Path
import re
from typing import Final

from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.errors import FrameError, SourceError
from phase_traj_ros.io.images.decoding import decode_picture_file, GreyImage
from phase_traj_ros.io.sources.base import (
    Candidate,
    DEFAULT_FPS,
    FrameSource,
    index_stamp_ns,
    selected_count,
)
from phase_traj_ros.io.sources.selection import EVERYTHING, Selection

PICTURE_SUFFIXES: Final = (
    '.png', '.jpg', '.jpeg', '.bmp', '.tif', '.tiff', '.pgm', '.ppm', '.webp')
"""What makes a file a picture, whatever the case."""

TIMES_FILE: Final = 'times.txt'
"""Name of the file with the stamp of each picture, in seconds, one per line."""

CALIBRATION_FILE: Final = 'calib.txt'
"""Name of the file with the projection matrices of a KITTI sequence, ``P0:`` to ``P3:``."""

# The grey cameras of KITTI first, the left one of each pair before the right one.
_KITTI_CAMERAS = ('image_0', 'image_2', 'image_1', 'image_3')
_BAG_SUFFIXES = ('.mcap', '.db3')
_MAX_SECONDS = Decimal(2 ** 63 // 10 ** 9)


class FolderSource(FrameSource):
    """
    The pictures of a folder in natural order of their names (2 before 10), 16 bits kept.

    The stamps are those of times.txt, in the folder or beside it: line by line where there are
    as many lines as pictures, else the line whose number, from 0 on, is the picture's name. An
    fps that is given is stronger than times.txt; without either it is 10. Where the folder itself
    has no pictures, but is a KITTI sequence, the first of its cameras is taken.

    Raises SourceError if there are no pictures or times.txt does not fit them.
    """

    def __init__(
        self,
        path: Path,
        *,
        selection: Selection = EVERYTHING,
        fps: float | None = None,
    ) -> None:
        folder, self._pictures = _find_pictures(path)
        self._folder = folder
        times = None if fps is not None else _find_times(folder)
        if times is None:
            rate = DEFAULT_FPS if fps is None else fps
            self._stamps = [index_stamp_ns(index, rate) for index in range(len(self._pictures))]
            origin = f'{rate:g} frames per second'
            origin += ' assumed' if fps is None else ''
        else:
            self._stamps = _stamps_from_times(self._pictures, times)
            origin = f'stamps from {times}'
        super().__init__(
            description=f'{folder} ({len(self._pictures)} pictures, {origin})',
            selection=selection,
            frame_count=selected_count(self._stamps, selection))

    def camera(self, *, rectified: bool) -> CameraModel | None:
        """
        Return the model of the camera of a KITTI sequence; None for other folders.

        It is that of the line P0 to P3 in calib.txt, beside the folder image_0 to image_3 that
        the pictures are in. They are rectified, whatever ``rectified`` says. Raises SourceError.
        """
        # resolve() first: "." has no name.
        folder = self._folder.resolve()
        calibration = folder.parent / CALIBRATION_FILE
        if folder.name not in _KITTI_CAMERAS or not calibration.is_file():
            return None
        name = f'P{folder.name[-1]}'
        height, width = read_picture(self._pictures[0]).shape
        try:
            matrix = _read_matrix(calibration, name)
            return CameraModel(
                width=width, height=height, fx=matrix[0], fy=matrix[5], cx=matrix[2],
                cy=matrix[6])
        except ValueError as error:
            raise SourceError(
                f'{calibration}, {name}: {error}; correct it, or give focal_px') from error

    def _candidates(self) -> Generator[Candidate, None, None]:
        for picture, stamp_ns in zip(self._pictures, self._stamps, strict=True):
            yield Candidate(stamp_ns, partial(read_picture, picture))


def natural_key(name: str) -> tuple[tuple[str | int, ...], str]:
    """Return a sort key that orders runs of digits by their value, the rest without case."""
    parts = re.split(r'([0-9]+)', name.casefold())
    return tuple(int(part) if index % 2 else part for index, part in enumerate(parts)), name


def _pictures_in(folder: Path) -> list[Path]:
    """Return the pictures right in the folder, in natural order."""
    try:
        found = [
            entry for entry in folder.iterdir()
            if entry.suffix.lower() in PICTURE_SUFFIXES
            and not entry.name.startswith('.')
            and entry.is_file()
        ]
    except OSError as error:
        raise SourceError(f'{folder} cannot be read: {error.strerror}') from error
    return sorted(found, key=lambda entry: natural_key(entry.name))


def _find_pictures(path: Path) -> tuple[Path, list[Path]]:
    """Return the folder that holds the pictures, and these."""
    pictures = _pictures_in(path)
    if pictures:
        return path, pictures
    for camera in _KITTI_CAMERAS:
        folder = path / camera
        if folder.is_dir():
            pictures = _pictures_in(folder)
            if pictures:
                return folder, pictures
    bags = [entry for entry in path.iterdir() if entry.suffix in _BAG_SUFFIXES]
    if bags:
        raise SourceError(
            f'{path} holds a ROS 2 bag without metadata.yaml (was the recording cut off?): run '
            f'`ros2 bag reindex {path}`, or give the file itself, such as {bags[0]}')
    raise SourceError(
        f'{path} holds no pictures ({", ".join(kind[1:] for kind in PICTURE_SUFFIXES)}), and no '
        'metadata.yaml of a ROS 2 bag')


def _find_times(folder: Path) -> Path | None:
    # resolve() first: the parent of "." would be "." again.
    for place in (folder, folder.resolve().parent):
        times = place / TIMES_FILE
        if times.is_file():
            return times
    return None


def _stamps_from_times(pictures: list[Path], times: Path) -> list[int]:
    """Return the stamp of each picture in nanoseconds."""
    stamps = read_times(times)
    if len(stamps) == len(pictures):
        return stamps
    numbers = [int(stem) if re.fullmatch('[0-9]+', stem := picture.stem) else None
               for picture in pictures]
    chosen = [
        stamps[number] for number in numbers if number is not None and number < len(stamps)]
    if len(chosen) != len(pictures):
        raise SourceError(
            f'{times} has {len(stamps)} lines for {len(pictures)} pictures, and their names are '
            'no line numbers; give --fps to do without it')
    return chosen


def read_times(path: Path) -> list[int]:
    """
    Read a file with a time in seconds on each line, to whole nanoseconds, exactly rounded.

    Blank lines at the end are ignored. Raises SourceError.
    """
    try:
        lines = path.read_text(encoding='ascii').rstrip().splitlines()
    except (OSError, ValueError) as error:
        raise SourceError(f'{path} cannot be read: {error}') from error
    stamps = []
    for number, line in enumerate(lines, 1):
        try:
            seconds = Decimal(line.strip())
            fits = abs(seconds) < _MAX_SECONDS
        except ArithmeticError:
            fits = False
        if not fits:
            raise SourceError(
                f'{path}, line {number}: {line.strip()[:40]!r} is not a time in seconds; correct '
                'it, or give --fps to do without the file')
        stamps.append(round(seconds * 1_000_000_000))
    return stamps


def _read_matrix(path: Path, name: str) -> list[float]:
    """Return the 12 numbers of a line ``name: ...``; raises ValueError."""
    try:
        lines = path.read_text(encoding='ascii').splitlines()
    except OSError as error:
        raise SourceError(f'{path} cannot be read: {error.strerror}') from error
    except ValueError as error:
        raise ValueError('the file is no text') from error
    found = [line.partition(':')[2].split() for line in lines if line.startswith(f'{name}:')]
    if not found:
        raise ValueError(f'there is no line {name!r}')
    if len(found[0]) != 12:
        raise ValueError(f'the line has {len(found[0])} numbers, not 12')
    return [float(word) for word in found[0]]


def read_picture(path: Path) -> GreyImage:
    try:
        return decode_picture_file(path.read_bytes())
    except OSError as error:
        raise SourceError(f'{path} cannot be read: {error.strerror}') from error
    except FrameError as error:
        raise SourceError(f'{path} cannot be used: {error}') from error
