# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Inputs and outputs: sources of frames, messages, replays and their results."""

from phase_traj_ros.io.images.decoding import GreyImage, MAX_PIXELS
from phase_traj_ros.io.messages.image import (
    decode_compressed,
    encoding_of,
    ENCODINGS,
    msg_to_frame,
    to_grey,
)
from phase_traj_ros.io.messages.stamps import StampRule, to_nanoseconds
from phase_traj_ros.io.sources.base import DEFAULT_FPS, FrameSource, StampedFrame
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.io.sources.prefetch import prefetch
from phase_traj_ros.io.sources.selection import EVERYTHING, Selection

__all__ = [
    'DEFAULT_FPS',
    'ENCODINGS',
    'EVERYTHING',
    'FrameSource',
    'GreyImage',
    'MAX_PIXELS',
    'Selection',
    'StampRule',
    'StampedFrame',
    'decode_compressed',
    'encoding_of',
    'msg_to_frame',
    'open_source',
    'prefetch',
    'to_grey',
    'to_nanoseconds',
]
