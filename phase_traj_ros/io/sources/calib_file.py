# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads calib.txt, the cameras of a KITTI sequence."""

from pathlib import Path
from typing import Final

from phase_traj_ros.core.camera.model import CameraModel
from phase_traj_ros.errors import reading, SourceError
from phase_traj_ros.io.images.decoding import read_picture
from phase_traj_ros.io.sources.times_file import both_ways

CALIBRATION_FILE: Final = 'calib.txt'
"""Name of the file with the projection matrices of a KITTI sequence, ``P0:`` to ``P3:``."""

KITTI_CAMERAS: Final = ('image_0', 'image_2', 'image_1', 'image_3')
"""Folders of a sequence: greyscale cameras first, the left one of each pair first."""


def kitti_camera(picture: Path) -> CameraModel | None:
    """
    Return the model of the camera that took a picture of a KITTI sequence.

    It is read from the line P0 to P3 of the calib.txt beside the picture's folder, image_0 to
    image_3. If the folder is a symbolic link, that of the link comes before that of its target.
    None if there is no such folder or file. The pictures are rectified.

    Raises
    ------
    SourceError
        calib.txt or the picture cannot be read, or the line cannot be used.

    """
    for folder in both_ways(picture.parent):
        calibration = folder.parent / CALIBRATION_FILE
        if folder.name in KITTI_CAMERAS and calibration.is_file():
            return _camera_of(calibration, f'P{folder.name[-1]}', picture)
    return None


def _camera_of(calibration: Path, name: str, picture: Path) -> CameraModel:
    """Return the camera from a line of a calib.txt, for pictures of the size of ``picture``."""
    height, width = read_picture(picture).shape
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
