# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads an image file."""

from pathlib import Path
from typing import Final

from phase_traj_ros.errors import FrameError, reading, SourceError
from phase_traj_ros.io.images.decoding import decode_picture_file, GreyImage

PICTURE_SUFFIXES: Final = (
    '.png', '.jpg', '.jpeg', '.bmp', '.tif', '.tiff', '.pgm', '.ppm', '.webp')
"""Suffixes of image files, in any case."""


def read_picture(path: Path) -> GreyImage:
    """Return the image as greyscale, (H, W); raises SourceError if it cannot be read."""
    with reading(path):
        content = path.read_bytes()
    try:
        return decode_picture_file(content)
    except FrameError as error:
        raise SourceError(f'{path} cannot be used: {error}') from error
