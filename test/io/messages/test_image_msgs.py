# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Conversion of raw and compressed image messages to greyscale."""

from array import array
from types import SimpleNamespace

import cv2
import numpy as np
from phase_traj_ros.errors import FrameError
from phase_traj_ros.io import decode_compressed, ENCODINGS, msg_to_frame, to_grey
from phase_traj_ros.io.images import decoding
from phase_traj_ros.io.images.header import read_header
from phase_traj_ros.io.messages import image
import pytest

BAYER = ['rggb', 'bggr', 'gbrg', 'grbg']


def mosaic(bgr, pattern):
    """Return the samples of a sensor with that colour filter, read from the corner on."""
    result = np.empty(bgr.shape[:2], bgr.dtype)
    for index, letter in enumerate(pattern):
        row, column = divmod(index, 2)
        result[row::2, column::2] = bgr[row::2, column::2, 'bgr'.index(letter)]
    return result


def packed_yuv(luma, luma_first):
    """Return (H, W, 2): the luma, and a chroma that must not get into the picture."""
    chroma = np.full_like(luma, 7)
    chroma[:, ::2] = 250
    return np.dstack([luma, chroma] if luma_first else [chroma, luma])


def encoded(bgr, encoding):
    """Return the pixels of the picture in that encoding, and the grey to expect."""
    luma = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
    deep = bgr.astype(np.uint16) * 200 + 37
    deep_luma = cv2.cvtColor(deep, cv2.COLOR_BGR2GRAY)
    opaque = np.full((*bgr.shape[:2], 1), 9)
    table = {
        'mono8': (luma, luma),
        '8UC1': (luma, luma),
        'mono16': (deep_luma, deep_luma),
        '16UC1': (deep_luma, deep_luma),
        'rgb8': (bgr[..., ::-1], luma),
        'bgr8': (bgr, luma),
        '8UC3': (bgr, luma),
        'rgba8': (np.dstack([bgr[..., ::-1], opaque]).astype(np.uint8), luma),
        'bgra8': (np.dstack([bgr, opaque]).astype(np.uint8), luma),
        '8UC4': (np.dstack([bgr, opaque]).astype(np.uint8), luma),
        'rgb16': (deep[..., ::-1], deep_luma),
        'bgr16': (deep, deep_luma),
        '16UC3': (deep, deep_luma),
        'rgba16': (np.dstack([deep[..., ::-1], opaque]).astype(np.uint16), deep_luma),
        'bgra16': (np.dstack([deep, opaque]).astype(np.uint16), deep_luma),
        'yuv422': (packed_yuv(luma, luma_first=False), luma),
        'uyvy': (packed_yuv(luma, luma_first=False), luma),
        'yuv422_yuy2': (packed_yuv(luma, luma_first=True), luma),
        'yuyv': (packed_yuv(luma, luma_first=True), luma),
        '32FC1': (luma / np.float32(3), luma / np.float32(3)),
    }
    return table[encoding]


@pytest.mark.parametrize('big_endian', [False, True])
@pytest.mark.parametrize('padding', [0, 2, 13])
@pytest.mark.parametrize(
    'encoding', [each for each in ENCODINGS if not each.startswith(('bayer_', 'nv'))])
def test_encoding(picture, image_msg, encoding, padding, big_endian):
    pixels, grey = encoded(picture(), encoding)
    msg = image_msg(pixels, encoding, padding=padding, big_endian=big_endian)
    result = to_grey(msg)
    assert result.dtype == grey.dtype
    np.testing.assert_array_equal(result, grey)
    # OpenCV accepts it without a copy, including padded rows.
    assert cv2.mean(result)[0] == pytest.approx(grey.mean())


def test_what_a_depth_camera_cannot_measure_is_zero(picture, image_msg):
    depth = picture()[..., 0].astype(np.float32)
    expected = depth.copy()
    for row, value in enumerate((np.nan, np.inf, -np.inf)):
        depth[row], expected[row] = value, 0
    msg = image_msg(depth, '32FC1', data=lambda raw: memoryview(b'x' + raw)[1:])
    np.testing.assert_array_equal(to_grey(msg), expected)


@pytest.mark.parametrize('encoding', ['nv12', 'nv21'])
@pytest.mark.parametrize('counts_colours', [False, True])
def test_the_luma_of_planes_comes_first(picture, image_msg, encoding, counts_colours):
    luma = picture()[..., 0]
    planes = np.vstack([luma, np.full((12, 32), 77, np.uint8)])
    msg = image_msg(planes, encoding, padding=6)
    if not counts_colours:
        msg.height = 24
    np.testing.assert_array_equal(to_grey(msg), luma)
    msg.height, msg.data = 25, msg.data[:25 * msg.step]
    with pytest.raises(FrameError, match=r'needs 1425 bytes .* but its data has 950'):
        to_grey(msg)


@pytest.mark.parametrize('depth', [8, 16])
@pytest.mark.parametrize('pattern', BAYER)
def test_mosaic_is_named_from_the_corner_on(picture, image_msg, pattern, depth):
    """The names in OpenCV are shifted; the four must not be confused."""
    # Strongly coloured, so that red taken for blue, or either for green, stands out.
    bgr = picture(40, 48) // 4 + np.array([0, 60, 190], np.uint8)
    if depth == 16:
        bgr = bgr.astype(np.uint16) * 256
    grey = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY).astype(float)
    inside = (slice(2, -2), slice(2, -2))
    errors = {
        name: np.abs(
            to_grey(image_msg(mosaic(bgr, pattern), f'bayer_{name}{depth}', padding=6))
            - grey)[inside].mean() / (1 if depth == 8 else 256)
        for name in BAYER
    }
    assert errors.pop(pattern) < 2.0
    assert min(errors.values()) > 15.0


@pytest.mark.parametrize('data', [
    bytes, bytearray, memoryview, lambda raw: array('B', raw),
    lambda raw: np.frombuffer(raw, np.uint8),
])
def test_data_may_be_any_buffer(picture, image_msg, data):
    pixels, grey = encoded(picture(), 'mono16')
    np.testing.assert_array_equal(to_grey(image_msg(pixels, 'mono16', data=data)), grey)


def test_mono8_is_not_copied(picture, image_msg):
    grey = picture()[..., 0]
    msg = image_msg(grey, 'mono8', padding=5, data=lambda raw: array('B', raw))
    result = to_grey(msg)
    assert np.shares_memory(result, np.frombuffer(msg.data, np.uint8))
    assert result.strides == (37, 1)


def test_samples_of_16_bits_at_odd_addresses(picture, image_msg):
    """A ROS 1 message leaves its data at any address; OpenCV needs it aligned."""
    pixels, grey = encoded(picture(), 'mono16')
    msg = image_msg(pixels, 'mono16', data=lambda raw: memoryview(b'x' + raw)[1:])
    result = to_grey(msg)
    np.testing.assert_array_equal(result, grey)
    assert result.flags.aligned
    assert cv2.mean(result)[0] == pytest.approx(grey.mean())


def test_padding_of_the_last_row_may_be_missing(picture, image_msg):
    pixels, grey = encoded(picture(), 'rgb8')
    msg = image_msg(pixels, 'rgb8', padding=32)
    msg.data = msg.data[:-32]
    np.testing.assert_array_equal(to_grey(msg), grey)
    msg.data = msg.data[:-1]
    with pytest.raises(FrameError, match=r'needs 3072 bytes .* but its data has 3039'):
        to_grey(msg)


def test_message_class_of_ros(picture, image_msg):
    messages = pytest.importorskip('sensor_msgs.msg')
    pixels, grey = encoded(picture(), 'bgr8')
    try:
        msg = messages.Image(**vars(image_msg(pixels, 'bgr8', data=lambda raw: array('B', raw))))
    except (ImportError, RuntimeError) as error:
        pytest.skip(f'ROS messages are not usable here: {error}')
    np.testing.assert_array_equal(msg_to_frame(msg), grey)


@pytest.mark.parametrize(('change', 'message'), [
    ({'height': 0}, '32x0 image .* no pixels'),
    ({'width': 0}, '0x24 image .* no pixels'),
    ({'step': 95}, 'step of 95 bytes, but a row needs 96'),
    ({'step': 97}, r'needs 2328 bytes \(height \* step\), but its data has 2304'),
    ({'data': b''}, 'its data has 0'),
    ({'encoding': 'h264'}, "'h264' is unknown; known are mono8, .*, yuyv"),
    ({'encoding': ''}, "'' is unknown"),
    ({'encoding': 'a\nb' + 'c' * 1000}, r"'a\\nbccc"),
    ({'height': 2 ** 32 - 1, 'width': 2 ** 32 - 1}, 'step'),
    ({'height': 2 ** 32 - 1}, 'but its data has'),
    ({'encoding': 'yuv422', 'width': 31}, 'odd width'),
    ({'encoding': 'bayer_rggb8', 'width': 2}, 'too small: a mosaic needs 3x3'),
])
def test_bad_message(picture, image_msg, change, message):
    msg = image_msg(picture(), 'rgb8')
    vars(msg).update(change)
    with pytest.raises(FrameError, match=message) as caught:
        to_grey(msg)
    assert '\n' not in str(caught.value)
    assert len(str(caught.value)) < 500


def compressed(suffix, pixels, name=None):
    done, data = cv2.imencode(suffix, pixels)
    assert done
    return SimpleNamespace(format=suffix[1:] if name is None else name, data=data.tobytes())


@pytest.mark.parametrize('data', [
    bytes, lambda raw: array('B', raw), lambda raw: np.frombuffer(raw, np.uint8)])
@pytest.mark.parametrize(('suffix', 'tolerance'), [('.png', 1), ('.jpg', 12)])
@pytest.mark.parametrize('colour', [False, True])
def test_compressed(picture, suffix, tolerance, colour, data):
    bgr = picture(48, 64)
    grey = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
    msg = compressed(suffix, bgr if colour else grey)
    msg.data = data(msg.data)
    result = msg_to_frame(msg)
    assert result.dtype == np.uint8
    assert result.shape == grey.shape
    assert np.abs(result.astype(int) - grey).max() <= tolerance


@pytest.mark.parametrize('colour', [False, True])
def test_compressed_16_bit_png_keeps_its_bits(picture, colour):
    bgr = picture().astype(np.uint16) * 200 + 37
    grey = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
    result = decode_compressed(compressed('.png', bgr if colour else grey))
    assert result.dtype == np.uint16
    assert np.abs(result.astype(int) - grey).max() <= 4


def test_compressed_with_transparency(picture):
    bgr = picture()
    rgba = np.dstack([bgr, np.full(bgr.shape[:2], 128, np.uint8)])
    result = decode_compressed(compressed('.png', rgba))
    grey = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
    assert np.abs(result.astype(int) - grey).max() <= 1


def test_compressed_mosaic_is_converted(picture):
    bgr = picture(40, 48) // 4 + np.array([0, 60, 190], np.uint8)
    grey = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
    name = 'bayer_grbg8; png compressed bayer_grbg8'
    result = decode_compressed(compressed('.png', mosaic(bgr, 'grbg'), name))
    assert np.abs(result.astype(float) - grey)[2:-2, 2:-2].mean() < 2
    # Already converted by the sender:
    result = decode_compressed(compressed('.png', bgr, 'bayer_grbg8; png compressed bgr8'))
    assert np.abs(result.astype(float) - grey).max() <= 1


def test_the_header_of_a_compressed_image_is_read_once(picture, monkeypatch):
    read = []

    def counted(data):
        read.append(data)
        return read_header(data)

    for module in (decoding, image):
        monkeypatch.setattr(module, 'read_header', counted, raising=False)
    pixels = mosaic(picture(48, 64), 'grbg')
    decode_compressed(compressed('.jpg', pixels, 'bayer_grbg8; jpeg compressed bayer_grbg8'))
    assert len(read) == 1


@pytest.mark.parametrize('suffix', ['.png', '.jpg'])
def test_compressed_cut_off(picture, suffix):
    msg = compressed(suffix, picture(48, 64))
    for length in [*range(1, 40), 100, len(msg.data) // 2, len(msg.data) - 12, len(msg.data) - 1]:
        cut = SimpleNamespace(format=suffix[1:], data=msg.data[:length])
        with pytest.raises(FrameError, match=r'compressed image .* cannot be used'):
            decode_compressed(cut)


@pytest.mark.parametrize('suffix', ['.png', '.jpg'])
def test_compressed_limit_is_judged_by_the_header(picture, suffix, monkeypatch):
    msg = compressed(suffix, picture(48, 64))
    monkeypatch.setattr(decoding, 'MAX_PIXELS', 48 * 64)
    assert msg_to_frame(msg).shape == (48, 64)
    monkeypatch.setattr(decoding, 'MAX_PIXELS', 48 * 64 - 1)
    with pytest.raises(FrameError, match='64x48 is larger than the limit of 3071 pixels'):
        msg_to_frame(msg)


@pytest.mark.parametrize('suffix', ['.png', '.jpg'])
def test_compressed_limit_comes_before_decoding(picture, suffix, monkeypatch):
    def decode(*_):
        raise AssertionError('decoded')

    monkeypatch.setattr(cv2, 'imdecode', decode)
    monkeypatch.setattr(decoding, 'MAX_PIXELS', 1)
    with pytest.raises(FrameError, match='larger than the limit'):
        decode_compressed(compressed(suffix, picture()))


@pytest.mark.parametrize('data', [
    b'', b'GIF89a', b'\x00' * 100, b'\xff\xd8', b'\x89PNG', b'\xff\xd8\xff' + b'\x00' * 50])
def test_compressed_foreign_data(data):
    with pytest.raises(FrameError):
        decode_compressed(SimpleNamespace(format='jpeg', data=data))
