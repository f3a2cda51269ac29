# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Size of a JPEG or PNG image, read without decoding it.

A few hundred bytes can claim an image, or a chunk of a PNG, of gigabytes, for which OpenCV takes
the memory, and older versions of it fill the missing part of a truncated JPEG with grey. So all of
this is checked before decoding. Damage inside of a PNG's chunk is found by OpenCV itself.

Sources: ITU-T T.81 (JPEG), annex B; W3C PNG specification, clauses 5 and 11.
"""

from dataclasses import dataclass
import re
import struct
from typing import Final

from phase_traj_ros.errors import FrameError

SIGNATURES: Final = (b'\xff\xd8\xff', b'\x89PNG\r\n\x1a\n')
"""What a JPEG and a PNG start with."""

_JPEG_END = b'\xff\xd9'
# libjpeg skips padding 0xFF, stray bytes and stuffed zeros between segments. They are skipped here
# too, so that both find the same header.
_JPEG_MARKER = re.compile(rb'\xff[^\x00\xff]', re.DOTALL)
_JPEG_START_OF_FRAME = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_JPEG_WITHOUT_LENGTH = frozenset({0x01, *range(0xD0, 0xD8)})
# Start of image, end of image, start of scan: no frame header follows.
_JPEG_TOO_LATE = frozenset({0xD8, 0xD9, 0xDA})
_PNG_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}


@dataclass(frozen=True, slots=True)
class PictureHeader:
    """Size of an image in pixels, and the number of samples of a decoded pixel."""

    width: int
    height: int
    channels: int


def read_header(data: bytes) -> PictureHeader:
    """
    Read the header of a JPEG or PNG image.

    Raises FrameError if it is neither, the header is cut off or damaged, or there is no end
    marker. Data after the end marker is ignored: some cameras pad.
    """
    jpeg, png = map(data.startswith, SIGNATURES)
    if not (jpeg or png):
        raise FrameError('it is neither a JPEG nor a PNG image' if data else 'it is empty')
    name = 'JPEG' if jpeg else 'PNG'
    found = _jpeg_header(data) if jpeg else _png_header(data)
    if found is None:
        raise FrameError(f'the header of the {name} image is cut off or damaged')
    header, end = found
    # Only after the header: a preview in front of it has an end marker, too.
    if not (data.find(_JPEG_END, end) >= 0 if jpeg else _png_ends(data, end)):
        raise FrameError(f'the {name} image is cut off or damaged (it has no end)')
    return header


def _jpeg_header(data: bytes) -> tuple[PictureHeader, int] | None:
    """Return the header, and the offset of the first byte after it; None if it is damaged."""
    position = 2
    while found := _JPEG_MARKER.search(data, position):
        marker, position = data[found.end() - 1], found.end()
        if marker in _JPEG_WITHOUT_LENGTH:
            continue
        length = int.from_bytes(data[position:position + 2], 'big')
        if marker in _JPEG_TOO_LATE or length < 2:
            return None
        if marker in _JPEG_START_OF_FRAME:
            if length < 8 or position + 8 > len(data):
                return None
            height, width, channels = struct.unpack_from('>HHB', data, position + 3)
            return PictureHeader(width, height, channels), position + length
        position += length
    return None


def _png_header(data: bytes) -> tuple[PictureHeader, int] | None:
    start = len(SIGNATURES[1])
    try:
        length, kind, width, height, colour = struct.unpack_from('>I4sIIxB', data, start)
        header = PictureHeader(width, height, _PNG_CHANNELS[colour])
    except (struct.error, KeyError):
        return None
    return (header, start + 25) if length == 13 and kind == b'IHDR' else None


def _png_ends(data: bytes, position: int) -> bool:
    """Return whether the chunks from that position on lead to the end, within the data."""
    while position + 12 <= len(data):
        length, kind = struct.unpack_from('>I4s', data, position)
        position += 12 + length
        if kind == b'IEND':
            return bool(position <= len(data))
    return False
