# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Size of a JPEG or PNG image, read by Pillow without decoding it.

A few hundred bytes can claim an image, or a chunk of a PNG, of gigabytes, for which OpenCV takes
the memory, and older versions of it fill the missing part of a truncated JPEG with grey. So all of
this is checked before decoding. Damage inside of a PNG's chunk is found by OpenCV itself.
"""

from io import BytesIO
import struct

from phase_traj_ros.errors import FrameError

SIGNATURES = (b'\xff\xd8\xff', b'\x89PNG\r\n\x1a\n')
"""What a JPEG and a PNG start with."""

_JPEG_END = b'\xff\xd9'


def read_header(data: bytes) -> tuple[int, int, int]:
    """
    Return the width and height of a JPEG or PNG image, and the number of samples of a pixel.

    Raises FrameError if it is neither, the header is cut off or damaged, or there is no end
    marker. Data after the end marker is ignored: some cameras pad.
    """
    # Loading it takes 60 ms, which a node of raw images saves.
    try:
        from PIL import Image
    except ImportError as error:
        raise FrameError('Pillow is missing: install python3-pil (apt) or Pillow') from error

    jpeg, png = map(data.startswith, SIGNATURES)
    if not (jpeg or png):
        raise FrameError('it is neither a JPEG nor a PNG image' if data else 'it is empty')
    name = 'JPEG' if jpeg else 'PNG'
    stream = BytesIO(data)
    try:
        with Image.open(stream, formats=(name,)) as image:
            width, height, channels = *image.size, len(image.getbands())
            end = stream.tell()
    except Image.DecompressionBombError as error:
        raise FrameError(f'the {name} image is too large: {error}') from error
    except (OSError, ValueError) as error:
        raise FrameError(f'the header of the {name} image is cut off or damaged') from error
    # Only after the header: a preview in front of it has an end marker, too.
    if not (data.find(_JPEG_END, end) >= 0 if jpeg else _png_ends(data)):
        raise FrameError(f'the {name} image is cut off or damaged (it has no end)')
    return width, height, channels


def _png_ends(data: bytes) -> bool:
    """Return whether the chunks lead to the end, within the data."""
    position = len(SIGNATURES[1])
    while position + 12 <= len(data):
        length, kind = struct.unpack_from('>I4s', data, position)
        position += 12 + length
        if kind == b'IEND':
            return bool(position <= len(data))
    return False
