# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames from a folder of pictures, such as a sequence of the KITTI odometry dataset."""

from collections.abc import Generator, Sequence
from functools import partial
from pathlib import Path
import re

from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.errors import reading, SourceError
from phase_traj_ros.io.images.decoding import PICTURE_SUFFIXES, read_picture
from phase_traj_ros.io.outputs.manifest import Manifest
from phase_traj_ros.io.sources.base import Candidate, DEFAULT_FPS, FrameSource, index_stamp_ns
from phase_traj_ros.io.sources.selection import EVERYTHING, Selection, Selector
from phase_traj_ros.io.sources.times_file import both_ways, find_times, stamps_of_pictures

_BAG_SUFFIXES = ('.mcap', '.db3')
# Greyscale cameras first, the left one of each pair first.
_KITTI_CAMERAS = ('image_0', 'image_2', 'image_1', 'image_3')


class FolderSource(FrameSource):
    """
    The pictures of a folder in natural order of their names (2 before 10); 16 bits are kept.

    The stamps are those of times.txt, in the folder or beside it (beside a symbolic link comes
    before beside its target). If it has as many lines as there are pictures, lines and pictures
    correspond; otherwise the name of each picture is the number of its line, from 0 on. A given
    fps overrides times.txt; without either, it is 10. If the folder itself has no pictures but is
    a KITTI sequence, its first camera is used.

    Raises SourceError if there are no pictures or times.txt does not match them.
    """

    def __init__(
        self,
        path: Path,
        *,
        selection: Selection = EVERYTHING,
        fps: float | None = None,
    ) -> None:
        folder, self._pictures = _find_pictures(path)
        times = None if fps is not None else find_times(folder)
        if times is None:
            rate = DEFAULT_FPS if fps is None else fps
            self._stamps = [index_stamp_ns(index, rate) for index in range(len(self._pictures))]
            origin = f'{rate:g} frames per second'
            origin += ' assumed' if fps is None else ''
        else:
            self._stamps = stamps_of_pictures(self._pictures, times)
            origin = f'stamps from {times}'
        pictures = f'{len(self._pictures)} image{"s" if len(self._pictures) > 1 else ""}'
        super().__init__(
            description=f'{folder} ({pictures}, {origin})',
            selection=selection,
            frame_count=sum(map(Selector(selection).judge, self._stamps)),
            declared=len(self._pictures))

    def camera(self, *, rectified: bool) -> CameraModel | None:
        """
        Return the model of the camera of a KITTI sequence; None for other folders.

        It is read from the line P0 to P3 of the calib.txt beside the picture folder, image_0 to
        image_3. If the folder is a symbolic link, that of the link comes before that of its
        target. The pictures are rectified, whatever ``rectified`` is.

        Raises SourceError if calib.txt or all pictures cannot be read, or the line cannot be used.
        """
        for folder in both_ways(self._pictures[0].parent):
            calibration = folder.parent / 'calib.txt'
            if folder.name in _KITTI_CAMERAS and calibration.is_file():
                return _camera_of(calibration, f'P{folder.name[-1]}', _size(self._pictures))
        return None

    def _candidates(self) -> Generator[Candidate, None, None]:
        for number, picture in enumerate(self._pictures):
            yield Candidate(number, self._stamps[number], partial(read_picture, picture))


def natural_key(name: str) -> tuple[tuple[str | int, ...], str]:
    """Return a sort key that orders runs of digits by value, and letters ignoring case."""
    parts = re.split(r'([0-9]+)', name.casefold())
    return tuple(int(part) if index % 2 else part for index, part in enumerate(parts)), name


def _pictures_in(folder: Path) -> list[Path]:
    """Return the pictures directly in the folder, in natural order."""
    with reading(folder):
        # Results of earlier runs are not frames.
        results = Manifest.of(folder).owned
        found = [
            entry for entry in folder.iterdir()
            if entry.suffix.lower() in PICTURE_SUFFIXES
            and not entry.name.startswith('.') and entry.name not in results
            # A link to nothing is a frame that cannot be read, and counted.
            and (entry.is_file() or not entry.exists())
        ]
    return sorted(found, key=lambda entry: natural_key(entry.name))


def _find_pictures(path: Path) -> tuple[Path, list[Path]]:
    """Return the folder that holds the pictures, and the pictures."""
    for folder in (path, *(path / camera for camera in _KITTI_CAMERAS)):
        pictures = _pictures_in(folder) if folder.is_dir() else []
        if any(picture.is_file() for picture in pictures):
            return folder, pictures
    bags = [entry for entry in path.iterdir() if entry.suffix in _BAG_SUFFIXES]
    if bags:
        raise SourceError(
            f'{path} holds a ROS 2 bag without metadata.yaml (was the recording cut off?): run '
            f'`ros2 bag reindex {path}`, or give the file itself, such as {bags[0]}')
    raise SourceError(
        f'{path} holds no images ({", ".join(kind[1:] for kind in PICTURE_SUFFIXES)}), and no '
        'metadata.yaml of a ROS 2 bag')


def _size(pictures: Sequence[Path]) -> tuple[int, ...]:
    """Return the size, (H, W), of the first picture that can be read."""
    first: SourceError | None = None
    for picture in pictures:
        try:
            return read_picture(picture).shape
        except SourceError as error:
            first = first or error
    raise SourceError(f'none of the pictures in {pictures[0].parent} can be read: {first}')


def _camera_of(calibration: Path, name: str, size: tuple[int, ...]) -> CameraModel:
    """Return the camera from a line of a calib.txt, for pictures of this size, (H, W)."""
    height, width = size
    try:
        matrix = _read_matrix(calibration, name)
        return CameraModel(
            width=width, height=height, fx=matrix[0], fy=matrix[5], cx=matrix[2], cy=matrix[6])
    except ValueError as error:
        raise SourceError(
            f'{calibration}, {name}: {error}; correct it, or give focal_px') from error


def _read_matrix(path: Path, name: str) -> list[float]:
    """Return the 12 numbers of a line ``name: ...``; raises ValueError."""
    with reading(path):
        lines = path.read_text(encoding='ascii', errors='replace').splitlines()
    found = [line.partition(':')[2].split() for line in lines if line.startswith(f'{name}:')]
    if not found:
        raise ValueError(f'there is no line {name!r}')
    if len(found[0]) != 12:
        raise ValueError(f'the line has {len(found[0])} numbers, not 12')
    return [float(word) for word in found[0]]
