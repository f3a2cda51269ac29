# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Size and completeness of a JPEG or PNG image, read without decoding it.

A few hundred bytes can claim an image of gigabytes, and OpenCV fills the missing part of a
truncated JPEG with grey and only prints a warning. So both are checked before decoding.

Sources: ITU-T T.81 (JPEG), annex B; W3C PNG specification, clauses 5 and 11.
"""

from dataclasses import dataclass
from enum import Enum
import re
import struct
import zlib

from phase_traj_ros.errors import FrameError

_JPEG_START = b'\xff\xd8\xff'
_JPEG_END_MARKER = b'\xff\xd9'
# libjpeg skips padding 0xFF, stray bytes and stuffed zeros between segments. They are skipped here
# too, so that both find the same header.
_JPEG_MARKER = re.compile(rb'\xff[^\x00\xff]', re.DOTALL)
_JPEG_START_OF_FRAME = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_JPEG_WITHOUT_LENGTH = frozenset({0x01, *range(0xD0, 0xD8)})
_JPEG_START_OF_IMAGE, _JPEG_END_OF_IMAGE, _JPEG_START_OF_SCAN = 0xD8, 0xD9, 0xDA
_JPEG_MAX_SEGMENTS = 1000

_PNG_SIGNATURE = b'\x89PNG\r\n\x1a\n'
_PNG_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}


class Container(Enum):
    """File format of a compressed image; the value is its name in messages."""

    JPEG = 'JPEG'
    PNG = 'PNG'


@dataclass(frozen=True, slots=True)
class PictureHeader:
    """
    Content of the header of a compressed image.

    width and height are in pixels, channels counts the samples of a decoded pixel, and end is the
    offset in bytes of the first byte after the header.
    """

    container: Container
    width: int
    height: int
    channels: int
    end: int


def recognise(data: bytes) -> Container | None:
    """Return the container whose signature data starts with; None for others."""
    if data.startswith(_JPEG_START):
        return Container.JPEG
    if data.startswith(_PNG_SIGNATURE):
        return Container.PNG
    return None


def read_header(data: bytes) -> PictureHeader:
    """
    Read the header of a JPEG or PNG image.

    Raises FrameError if the container is another one or the header is cut off or damaged.
    """
    container = recognise(data)
    if container is None:
        raise FrameError('it is neither a JPEG nor a PNG picture' if data else 'it is empty')
    header = _jpeg_header(data) if container is Container.JPEG else _png_header(data)
    if header.width == 0 or header.height == 0:
        raise FrameError(
            f'the {container.value} picture has a size of {header.width}x{header.height}')
    return header


def check_complete(data: bytes, header: PictureHeader) -> None:
    """
    Check that the image whose header was read from data is complete.

    A JPEG must have its end marker (data after it is ignored: some cameras pad), a PNG all chunks
    up to IEND, the critical ones with matching checksums. Raises FrameError if it is cut off or
    damaged.
    """
    if header.container is Container.JPEG:
        if data.rfind(_JPEG_END_MARKER, header.end) < 0:
            raise FrameError('the JPEG picture is cut off (it has no end marker)')
    else:
        _check_png_chunks(data)


def _jpeg_header(data: bytes) -> PictureHeader:
    cut_off = FrameError('the JPEG picture is cut off in its header')
    position = 2
    for _ in range(_JPEG_MAX_SEGMENTS):
        found = _JPEG_MARKER.search(data, position)
        if found is None:
            raise cut_off
        marker, position = data[found.end() - 1], found.end()
        if marker in _JPEG_WITHOUT_LENGTH:
            continue
        if marker in (_JPEG_START_OF_IMAGE, _JPEG_END_OF_IMAGE, _JPEG_START_OF_SCAN):
            break
        if position + 2 > len(data):
            raise cut_off
        length = int.from_bytes(data[position:position + 2], 'big')
        if marker in _JPEG_START_OF_FRAME:
            if length < 8:
                break
            if position + 8 > len(data):
                raise cut_off
            height, width, channels = struct.unpack_from('>HHB', data, position + 3)
            return PictureHeader(
                Container.JPEG, width, height, channels, position + length)
        if length < 2:
            break
        position += length
    raise FrameError('the JPEG picture has a damaged header (no frame size before its data)')


def _png_header(data: bytes) -> PictureHeader:
    start = len(_PNG_SIGNATURE)
    end = start + 25
    if len(data) < end:
        raise FrameError('the PNG picture is cut off in its header')
    length, kind, width, height, colour = struct.unpack_from('>I4sIIxB', data, start)
    (checksum,) = struct.unpack_from('>I', data, end - 4)
    if (length != 13 or kind != b'IHDR' or colour not in _PNG_CHANNELS
            or checksum != zlib.crc32(data[start + 4:end - 4])):
        raise FrameError('the PNG picture has a damaged header')
    return PictureHeader(Container.PNG, width, height, _PNG_CHANNELS[colour], end)


def _check_png_chunks(data: bytes) -> None:
    view = memoryview(data)
    position = len(_PNG_SIGNATURE)
    while position + 12 <= len(data):
        length, kind = struct.unpack_from('>I4s', data, position)
        end = position + 12 + length
        if end > len(data):
            break
        # An upper-case first letter marks a chunk that decoders require.
        critical = kind[:1].isupper()
        if critical and zlib.crc32(view[position + 4:end - 4]) != int.from_bytes(
                view[end - 4:end], 'big'):
            raise FrameError('the PNG picture is damaged (wrong checksum)')
        if kind == b'IEND':
            return
        position = end
    raise FrameError('the PNG picture is cut off (it has no end chunk)')
