# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Decodes compressed images and image files to greyscale."""

from pathlib import Path
from typing import cast, TypeAlias

import cv2
import numpy as np
import numpy.typing as npt
from phase_traj_ros.errors import FrameError, reading, SourceError
from phase_traj_ros.io.images.header import read_header, SIGNATURES

GreyImage: TypeAlias = npt.NDArray[np.uint8] | npt.NDArray[np.uint16] | npt.NDArray[np.float32]
"""A greyscale image, (H, W), uint8, uint16 or float32."""

PICTURE_SUFFIXES = (
    '.png', '.jpg', '.jpeg', '.bmp', '.tif', '.tiff', '.pgm', '.ppm', '.webp')
"""Suffixes of image files, in any case."""

MAX_PIXELS = 2 ** 26
"""Limit of the size of a decoded image: 67 million pixels."""


def decode_picture(data: bytes) -> tuple[GreyImage, int]:
    """
    Decode a JPEG or PNG to greyscale, (H, W), uint8, or uint16 for a PNG of 16 bits.

    The number of samples of a pixel in the file is returned as well. Raises FrameError if it is
    neither, has more than MAX_PIXELS pixels (found before decoding), or is cut off or damaged.
    """
    width, height, channels = read_header(data)
    if width * height > MAX_PIXELS:
        raise FrameError(
            f'the image of {width}x{height} is larger than the limit of {MAX_PIXELS} pixels')
    return _decode(data), channels


def read_picture(path: Path) -> GreyImage:
    """
    Return an image file of any format that OpenCV reads as greyscale, (H, W).

    JPEG and PNG are checked as in decode_picture. Raises SourceError if it cannot be read.
    """
    with reading(path):
        data = path.read_bytes()
    try:
        if not data:
            raise FrameError('it is empty')
        return decode_picture(data)[0] if data.startswith(SIGNATURES) else _decode(data)
    except FrameError as error:
        raise SourceError(f'{path} cannot be used: {error}') from error


def _decode(data: bytes) -> GreyImage:
    """Decode to greyscale with OpenCV, keeping 16 bits."""
    try:
        image = cv2.imdecode(
            np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH)
    except cv2.error as error:
        raise FrameError(f'OpenCV cannot decode it ({error.err})') from error
    if image is None:
        raise FrameError('OpenCV cannot decode it (cut off, damaged, or of an unknown format)')
    if image.ndim != 2 or image.dtype.name not in ('uint8', 'uint16'):
        raise FrameError(f'its pixels are {image.dtype}; only 8 and 16 bits are supported')
    return cast('GreyImage', image)
