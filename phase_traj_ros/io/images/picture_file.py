# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads the file of a picture."""

from pathlib import Path
from typing import Final

from phase_traj_ros.errors import FrameError, SourceError
from phase_traj_ros.io.images.decoding import decode_picture_file, GreyImage

PICTURE_SUFFIXES: Final = (
    '.png', '.jpg', '.jpeg', '.bmp', '.tif', '.tiff', '.pgm', '.ppm', '.webp')
"""What makes a file a picture, whatever the case."""


def read_picture(path: Path) -> GreyImage:
    """Return the picture as a grey image, (H, W); raises SourceError."""
    try:
        return decode_picture_file(path.read_bytes())
    except OSError as error:
        raise SourceError(f'{path} cannot be read: {error.strerror}') from error
    except FrameError as error:
        raise SourceError(f'{path} cannot be used: {error}') from error
