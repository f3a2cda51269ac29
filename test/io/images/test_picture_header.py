# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Size and completeness of compressed images, without decoding."""

import struct
import zlib

import cv2
import numpy as np
from phase_traj_ros.errors import FrameError
from phase_traj_ros.io.images.decoding import decode_picture
from phase_traj_ros.io.images.header import read_header
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
    assert read_header(data) == (53, 37, 3)


def test_png():
    data = picture_file('.png', (37, 53), np.uint16)
    assert read_header(data) == (53, 37, 1)


def test_jpeg_preview_in_the_header_is_not_taken_for_the_picture():
    """A camera's preview is a complete JPEG inside a segment, with its own size and end."""
    preview = picture_file('.jpg', (8, 8))
    data = picture_file('.jpg', (37, 53))
    segment = b'\xff\xe1' + struct.pack('>H', len(preview) + 2) + preview
    data = data[:2] + segment + data[2:]
    assert read_header(data) == (53, 37, 1)
    with pytest.raises(FrameError, match='cut off'):
        read_header(data[:-2])


def test_jpeg_may_have_fill_bytes_and_be_padded():
    data = picture_file('.jpg', (37, 53))
    data = data[:2] + b'\xff\xff\xff' + data[2:] + b'\x00' * 1000
    assert read_header(data) == (53, 37, 1)


@pytest.mark.parametrize('body', [
    b'\xff', b'\xff\xe0', b'\xff\xc0\x00\x11\x08\x00', b'\xff\xe0\x00\x01' + b'\x00' * 20,
    b'\xff\xc0\x00\x02' + b'\x00' * 20, b'\xff\xda\x00\x0c' + b'\x00' * 20,
    b'\xff\xd8' + b'\x00' * 20, b'\xff\xd9', b'\xff\xe0\x00\x02' * 5000, b'\xff' * 1_000_000,
    b'\xff\x00' * 500_000])
def test_broken_jpeg_header(body):
    with pytest.raises(FrameError, match='header of the JPEG image is cut off or damaged'):
        read_header(b'\xff\xd8' + body)


def test_broken_png():
    """Whatever bit is wrong, and wherever it is cut off, it is refused."""
    good = picture_file('.png', (7, 5))
    assert decode_picture(good)[0].shape == (7, 5)
    for position in range(8, len(good) - 12):
        bad = bytearray(good)
        bad[position] ^= 4
        with pytest.raises(FrameError):
            decode_picture(bytes(bad))
        with pytest.raises(FrameError, match='cut off'):
            decode_picture(good[:position])


@pytest.mark.parametrize('data', [
    png(0, 7), b'\xff\xd8\xff\xc0\x00\x0b\x08\x00\x00\x00\x05\x01' + b'\x00' * 9 + b'\xff\xd9',
    png(5, 7, struct.pack('>I', 2 ** 32 - 1) + b'IDAT' + b'\x00' * 100)])
def test_pictures_that_cannot_be(data):
    with pytest.raises(FrameError):
        decode_picture(data)


@pytest.mark.parametrize(('data', 'message'), [
    (b'', 'empty'), (b'RIFF....WEBP', 'neither a JPEG nor a PNG'), (b'\xff\xd8', 'neither')])
def test_other_data(data, message):
    with pytest.raises(FrameError, match=message):
        read_header(data)


def test_a_chunk_that_claims_gigabytes_is_refused_before_it_takes_memory():
    good = picture_file('.png', (7, 5))
    end = good.index(b'IEND') - 4
    for length in (2 ** 29, 2 ** 31 - 1):
        data = good[:end] + struct.pack('>I', length) + b'tEXt' + good[end:]
        with pytest.raises(FrameError, match='it has no end'):
            read_header(data)
    comment = struct.pack('>I', 3) + b'tEXtabc' + struct.pack('>I', zlib.crc32(b'tEXtabc'))
    assert decode_picture(good[:end] + comment + good[end:])[0].shape == (7, 5)


def test_what_pillow_refuses_as_too_large_is_not_called_damaged():
    with pytest.raises(FrameError, match='PNG image is too large'):
        read_header(png(20_000, 20_000, png_chunk(b'IDAT', b'')))
