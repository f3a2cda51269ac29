# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Size and completeness of compressed images, without decoding."""

import struct
import zlib

import cv2
import numpy as np
from phase_traj_ros.errors import FrameError
from phase_traj_ros.io.images.header import check_complete, Container, read_header
import pytest


def picture_file(suffix, shape, dtype=np.uint8, options=()):
    pixels = np.random.default_rng(1).integers(0, 256, shape).astype(dtype)
    done, data = cv2.imencode(suffix, pixels, options)
    assert done
    return data.tobytes()


def png_chunk(kind, body):
    return struct.pack('>I', len(body)) + kind + body + struct.pack(
        '>I', zlib.crc32(kind + body))


def png(width, height, *chunks):
    header = png_chunk(b'IHDR', struct.pack('>IIBBBBB', width, height, 8, 0, 0, 0, 0))
    return b'\x89PNG\r\n\x1a\n' + header + b''.join(chunks)


@pytest.mark.parametrize(('options', 'name'), [
    ((), 'baseline'),
    ((cv2.IMWRITE_JPEG_PROGRESSIVE, 1), 'progressive'),
    ((cv2.IMWRITE_JPEG_RST_INTERVAL, 2), 'restart markers'),
])
def test_jpeg(options, name):
    data = picture_file('.jpg', (37, 53, 3), options=options)
    header = read_header(data)
    assert (header.container, header.width, header.height, header.channels) == (
        Container.JPEG, 53, 37, 3)
    check_complete(data, header)


def test_png():
    data = picture_file('.png', (37, 53), np.uint16)
    header = read_header(data)
    assert (header.container, header.width, header.height, header.channels) == (
        Container.PNG, 53, 37, 1)
    check_complete(data, header)


def test_jpeg_preview_in_the_header_is_not_taken_for_the_picture():
    """A camera's preview is a complete JPEG inside a segment, with its own size and end."""
    preview = picture_file('.jpg', (8, 8))
    data = picture_file('.jpg', (37, 53))
    segment = b'\xff\xe1' + struct.pack('>H', len(preview) + 2) + preview
    data = data[:2] + segment + data[2:]
    header = read_header(data)
    assert (header.width, header.height) == (53, 37)
    check_complete(data, header)
    with pytest.raises(FrameError, match='cut off'):
        check_complete(data[:-2], header)


def test_jpeg_may_have_fill_bytes_and_be_padded():
    data = picture_file('.jpg', (37, 53))
    data = data[:2] + b'\xff\xff\xff' + data[2:] + b'\x00' * 1000
    header = read_header(data)
    assert (header.width, header.height) == (53, 37)
    check_complete(data, header)


@pytest.mark.parametrize(('body', 'message'), [
    (b'', 'cut off in its header'),
    (b'\xff\xe0', 'cut off in its header'),
    (b'\xff\xc0\x00\x11\x08\x00', 'cut off in its header'),
    (b'\xff\xe0\x00\x01' + b'\x00' * 20, 'damaged header'),
    (b'\xff\xc0\x00\x02' + b'\x00' * 20, 'damaged header'),
    (b'\xff\xda\x00\x0c' + b'\x00' * 20, 'damaged header'),
    (b'\xff\xd8' + b'\x00' * 20, 'damaged header'),
    (b'\xff\xd9', 'damaged header'),
    (b'\xff\xe0\x00\x02' * 5000, 'damaged header'),
    (b'\xff' * 1_000_000, 'cut off in its header'),
    (b'\xff\x00' * 500_000, 'cut off in its header'),
    (b'\xff\xc0\x00\x0b\x08\x00\x00\x00\x05\x01' + b'\x00' * 9, 'size of 5x0'),
])
def test_broken_jpeg_header(body, message):
    with pytest.raises(FrameError, match=message):
        read_header(b'\xff\xd8' + (body or b'\xff'))


def test_broken_png_header():
    good = png(5, 7)
    assert read_header(good).height == 7
    for position in range(8, 33):
        bad = bytearray(good)
        bad[position] ^= 4
        with pytest.raises(FrameError, match='damaged header'):
            read_header(bytes(bad))
    with pytest.raises(FrameError, match='cut off'):
        read_header(good[:32])
    with pytest.raises(FrameError, match='size of 0x7'):
        read_header(png(0, 7))


def test_png_checksums():
    data = bytearray(picture_file('.png', (37, 53)))
    data[len(data) // 2] ^= 1
    with pytest.raises(FrameError, match='wrong checksum'):
        check_complete(bytes(data), read_header(bytes(data)))
    # What a decoder may ignore may also be damaged.
    comment = bytearray(png_chunk(b'tEXt', b'Comment\x00hello'))
    comment[-1] ^= 1
    whole = png(5, 7, bytes(comment), png_chunk(b'IEND', b''))
    check_complete(whole, read_header(whole))


def test_png_chunk_that_claims_too_much():
    data = png(5, 7, struct.pack('>I', 2 ** 32 - 1) + b'IDAT' + b'\x00' * 100)
    with pytest.raises(FrameError, match='cut off'):
        check_complete(data, read_header(data))


@pytest.mark.parametrize(('data', 'message'), [
    (b'', 'empty'), (b'RIFF....WEBP', 'neither a JPEG nor a PNG'), (b'\xff\xd8', 'neither')])
def test_other_data(data, message):
    with pytest.raises(FrameError, match=message):
        read_header(data)
