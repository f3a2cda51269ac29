# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Random messages and damaged files give a clear error or frames, and nothing else.

An exception of another kind, a crash, a hang or a huge allocation fails the test.
"""

from contextlib import suppress
from importlib.util import find_spec
import random
import resource
from types import SimpleNamespace

import cv2
from hypothesis import given, settings, strategies as st
import numpy as np
from phase_traj_ros.errors import FrameError, SourceError
from phase_traj_ros.io import decode_compressed, ENCODINGS, open_source, to_grey
from phase_traj_ros.io.images import decoding
import pytest

MEGABYTE = 1024  # ru_maxrss counts kilobytes


@pytest.fixture(autouse=True)
def memory_stays_small():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    yield
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 300 * MEGABYTE


def check_image(image):
    assert image.ndim == 2
    assert image.dtype in (np.uint8, np.uint16, np.float32)
    assert image.flags.aligned
    assert image.dtype.isnative
    # Every pixel can be read, by numpy and by OpenCV.
    if image.dtype == np.float32:
        assert np.isfinite(image).all() and cv2.checkRange(image)
    else:
        assert cv2.sumElems(image)[0] == image.sum(dtype=np.int64)


size = st.one_of(st.integers(0, 12), st.sampled_from([2 ** 16, 2 ** 31 - 1, 2 ** 32 - 1]))
encoding = st.one_of(st.sampled_from(ENCODINGS), st.text(max_size=5))


@settings(max_examples=400)
@given(
    st.builds(
        SimpleNamespace, height=size, width=size, encoding=encoding,
        is_bigendian=st.integers(0, 255),
        step=st.one_of(size, st.integers(0, 120)),
        data=st.binary(max_size=600)))
def test_any_image_message(msg):
    with suppress(FrameError):
        check_image(to_grey(msg))


def bytes_of_a_pixel(name):
    samples = 1
    if name.startswith(('rgba', 'bgra')) or name.endswith('C4'):
        samples = 4
    elif name.startswith(('rgb', 'bgr')) or name.endswith('C3'):
        samples = 3
    elif name.startswith(('yuv', 'uyvy', 'yuyv')):
        samples = 2
    return samples * (4 if '32' in name else 2 if '16' in name else 1)


@settings(max_examples=400)
@given(
    height=st.integers(1, 12), width=st.integers(1, 12),
    name=st.sampled_from([each for each in ENCODINGS if not each.startswith('nv')]),
    big_endian=st.booleans(), padding=st.integers(0, 9), missing=st.integers(-3, 12),
    offset=st.integers(0, 3), seed=st.integers(0, 2 ** 32 - 1))
def test_nearly_good_image_message(
        height, width, name, big_endian, padding, missing, offset, seed):
    step = width * bytes_of_a_pixel(name) + padding
    raw = random.Random(seed).randbytes(offset + height * step)
    end = max(offset, len(raw) - max(missing, 0))
    msg = SimpleNamespace(
        height=height, width=width, encoding=name, is_bigendian=big_endian, step=step,
        data=memoryview(raw)[offset:end])
    good = missing <= padding
    if name.startswith('bayer_'):
        good = good and min(height, width) >= 3
    if name.startswith(('yuv', 'uyvy', 'yuyv')):
        good = good and width % 2 == 0
    if good:
        image = to_grey(msg)
        assert image.shape == (height, width)
        check_image(image)
    else:
        with pytest.raises(FrameError):
            to_grey(msg)


@pytest.mark.parametrize('suffix', ['.png', '.jpg'])
def test_damaged_compressed_images(picture, suffix, monkeypatch):
    monkeypatch.setattr(decoding, 'MAX_PIXELS', 10 ** 6)
    rng = random.Random(4)
    done, data = cv2.imencode(suffix, picture(48, 64))
    assert done
    whole = data.tobytes()
    for _ in range(300):
        msg = SimpleNamespace(format='', data=damaged(whole, rng))
        with suppress(FrameError):
            check_image(decode_compressed(msg))


def damaged(whole, rng):
    """Return the bytes with bits flipped, bytes replaced, or a part missing."""
    data = bytearray(whole)
    kind = rng.randrange(4)
    if kind == 0:
        return bytes(data[:rng.randrange(len(data))])
    if kind == 1:
        start = rng.randrange(len(data))
        del data[start:start + rng.randrange(1, 200)]
        return bytes(data)
    for _ in range(rng.randint(1, 6)):
        # Headers and indices are at the ends.
        place = rng.choice([
            rng.randrange(len(data)), rng.randrange(min(400, len(data))),
            len(data) - 1 - rng.randrange(min(800, len(data)))])
        if kind == 2:
            data[place] ^= 1 << rng.randrange(8)
        else:
            data[place:place + 4] = rng.choice([b'\xff' * 4, b'\x00' * 4, rng.randbytes(4)])
    return bytes(data)


def error_of(path):
    """Read a bag; return the error's message, '' if there is none."""
    try:
        with open_source(path) as source:
            for frame in source:
                check_image(frame.image)
    except (SourceError, FrameError) as error:
        return str(error)
    return ''


@pytest.mark.skipif(not find_spec('rosbags'), reason='rosbag2_py itself crashes on some bags')
def test_damaged_bags(tmp_path, maker):
    rng = random.Random(5)
    file = maker.single_file(maker.drive(tmp_path / 'bag', frames=3))
    whole = file.read_bytes()
    messages = []
    for _ in range(250):
        file.write_bytes(damaged(whole, rng))
        messages.append(error_of(file))
    assert sum(message != '' for message in messages) > 50
    assert all('\n' not in message and len(message) < 1000 for message in messages)


def test_damaged_metadata(tmp_path, mcap_maker):
    rng = random.Random(6)
    path = mcap_maker.drive(tmp_path / 'bag', frames=3)
    metadata = path / 'metadata.yaml'
    whole = metadata.read_bytes()
    messages = []
    for _ in range(60):
        metadata.write_bytes(damaged(whole, rng))
        messages.append(error_of(path))
    assert sum(message != '' for message in messages) > 10
    assert all('\n' not in message and len(message) < 1000 for message in messages)
