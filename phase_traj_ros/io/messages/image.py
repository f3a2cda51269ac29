# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Converts image messages to greyscale.

This module does not need ROS: it accepts any object with the fields of sensor_msgs/Image or
sensor_msgs/CompressedImage, such as the messages of rclpy and rosbags.
"""

from dataclasses import dataclass
from typing import Any, cast

import cv2
import numpy as np
from phase_traj_ros.errors import FrameError
from phase_traj_ros.io.images.decoding import decode_picture, GreyImage


@dataclass(frozen=True, slots=True)
class _Layout:
    """
    Positions of the samples of an encoding, and their conversion to grey.

    sample is their type in numpy. Colours, mosaics and pixels of YUV have the code of
    cv2.cvtColor. If the layout is planar, the luma comes first, and the colours follow in half as
    many rows.
    """

    channels: int
    sample: str
    code: int | None = None
    planar: bool = False


_UYVY = _Layout(2, 'u1', cv2.COLOR_YUV2GRAY_UYVY)
_YUY2 = _Layout(2, 'u1', cv2.COLOR_YUV2GRAY_YUY2)
_NV = _Layout(1, 'u1', planar=True)

# ROS names a mosaic by its first two rows from the corner on; OpenCV's original names start at the
# second pixel of the second row.
_MOSAICS = {'rggb': 'BG', 'bggr': 'RG', 'gbrg': 'GR', 'grbg': 'GB'}
_LAYOUTS = {
    'mono8': _Layout(1, 'u1'),
    '8UC1': _Layout(1, 'u1'),
    'mono16': _Layout(1, 'u2'),
    '16UC1': _Layout(1, 'u2'),
    **{f'{name}{bits}': _Layout(
        len(name), f'u{bits // 8}', getattr(cv2, f'COLOR_{name.upper()}2GRAY'))
       for bits in (8, 16) for name in ('rgb', 'bgr', 'rgba', 'bgra')},
    '8UC3': _Layout(3, 'u1', cv2.COLOR_BGR2GRAY),
    '8UC4': _Layout(4, 'u1', cv2.COLOR_BGRA2GRAY),
    '16UC3': _Layout(3, 'u2', cv2.COLOR_BGR2GRAY),
    **{f'bayer_{name}{bits}': _Layout(1, f'u{bits // 8}', getattr(cv2, f'COLOR_Bayer{code}2GRAY'))
       for bits in (8, 16) for name, code in _MOSAICS.items()},
    'yuv422': _UYVY,
    'uyvy': _UYVY,
    'yuv422_yuy2': _YUY2,
    'yuyv': _YUY2,
    'nv12': _NV,
    'nv21': _NV,
    '32FC1': _Layout(1, 'f4'),
}

ENCODINGS = tuple(_LAYOUTS)
"""Names of the encodings that to_grey supports."""

_MIN_MOSAIC_SIDE = 3


def to_grey(msg: Any) -> GreyImage:
    """
    Convert a raw image message to grey, (H, W): uint8, uint16, or float32, as the encoding has it.

    A grey image is returned as a view of the message's data if possible: do not write to it, and
    keep the data unchanged while the image is in use. Rows may be padded, which numpy and
    OpenCV both support. Colours are converted to luma as in cv2.cvtColor; the luma of YUV is
    used as it is. The padding of the last row may be missing. In 32FC1, such as of thermal and
    depth cameras, NaN and infinity become 0.

    Raises FrameError if the encoding is unknown or the fields contradict each other.
    """
    layout = _LAYOUTS.get(msg.encoding)
    if layout is None:
        raise FrameError(
            f'the image encoding {msg.encoding[:40]!r} is unknown; known are '
            f'{", ".join(ENCODINGS)}')
    pixels = _samples(msg, layout)
    if layout.code is not None:
        return cast('GreyImage', cv2.cvtColor(pixels, layout.code))
    return pixels


def decode_compressed(msg: Any) -> GreyImage:
    """
    Decode a compressed image message to grey, (H, W), uint8, or uint16 for a PNG of 16 bits.

    A mosaic that was compressed without conversion (the format field starts with its encoding)
    is converted as well.

    Raises FrameError, before decoding, if the data is not a complete JPEG or PNG image or has
    more than MAX_PIXELS pixels.
    """
    data = memoryview(msg.data).tobytes()
    name = str(getattr(msg, 'format', ''))
    try:
        image, channels = decode_picture(data)
    except FrameError as error:
        raise FrameError(
            f'the compressed image (format {name[:40]!r}) cannot be used: {error}') from error
    layout = _LAYOUTS.get(name.partition(';')[0].strip())
    if (name.startswith('bayer_') and layout is not None and layout.code is not None
            and channels == 1):
        return cast('GreyImage', cv2.cvtColor(image, layout.code))
    return image


def msg_to_frame(msg: object) -> GreyImage:
    """
    Convert a raw or compressed image message to a grey image; its fields decide which it is.

    Raises FrameError as to_grey and decode_compressed do.
    """
    return to_grey(msg) if hasattr(msg, 'encoding') else decode_compressed(msg)


def encoding_of(msg: object) -> str:
    """Return the encoding of a raw image message, or the format of a compressed one."""
    return str(getattr(msg, 'encoding', '') or getattr(msg, 'format', ''))


def _samples(msg: Any, layout: _Layout) -> GreyImage:
    """Check the fields for consistency, then view data as (H, W) or (H, W, C) samples."""
    height, width, step = msg.height, msg.width, msg.step
    what = f'the {width}x{height} image of encoding {msg.encoding}'
    if height <= 0 or width <= 0:
        raise FrameError(f'{what} has no pixels')
    if layout.channels == 2 and width % 2:
        raise FrameError(f'{what} has an odd width, but two pixels share their colour')
    if msg.encoding.startswith('bayer_') and min(width, height) < _MIN_MOSAIC_SIDE:
        raise FrameError(
            f'{what} is too small: a mosaic needs {_MIN_MOSAIC_SIDE}x{_MIN_MOSAIC_SIDE} pixels')
    sample: np.dtype[Any] = np.dtype(layout.sample).newbyteorder('>' if msg.is_bigendian else '<')
    pixel = layout.channels * sample.itemsize
    row = width * pixel
    if step < row:
        raise FrameError(f'{what} has a step of {step} bytes, but a row needs {row}')
    raw = np.frombuffer(msg.data, np.uint8)
    if layout.planar:
        height = _rows_of_luma(raw.size, height, step, what)
    if raw.size < (height - 1) * step + row:
        raise FrameError(
            f'{what} needs {height * step} bytes (height * step), but its data has {raw.size}')

    if height == 1:
        step = row
    view = np.ndarray(
        (height, width, layout.channels), sample, raw, strides=(step, pixel, sample.itemsize))
    if layout.channels == 1:
        view = view[:, :, 0]
    if not (sample.isnative and view.flags.aligned):
        view = view.astype(sample.newbyteorder('='))
    if sample.kind == 'f' and not np.isfinite(view).all():
        view = np.nan_to_num(view, nan=0.0, posinf=0.0, neginf=0.0)
    return cast('GreyImage', view)


def _rows_of_luma(size: int, height: int, step: int, what: str) -> int:
    """Return the rows of the first plane; some drivers count those of the colours in height."""
    if size >= height * step * 3 // 2:
        return height
    if height % 3:
        raise FrameError(
            f'{what} needs {height * step * 3 // 2} bytes (height * step * 3 / 2), but its data'
            f' has {size}')
    return height * 2 // 3
