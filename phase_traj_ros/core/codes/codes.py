# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The two codes of the method, and their packed form."""

from collections.abc import Iterable
from enum import IntEnum

import numpy as np


class Code(IntEnum):
    """The base of all codes."""

    @property
    def label(self) -> str:
        """Return the name of the code for users, such as ``no change``."""
        return self.name.lower().replace('_', ' ')


class Movement(Code):
    """What the vehicle does in one pair of frames (the paper's dynamic chain code, MSCC)."""

    LEFT = 0
    FORWARD = 1
    RIGHT = 2
    NO_CHANGE = 3


class Direction(Code):
    """Heading relative to the start, in quarter turns (the actual chain code, ISCC)."""

    LEFT = 0
    FORWARD = 1
    RIGHT = 2
    BACKWARD = 3
    """Heading opposite to the start. It does not mean that the vehicle reverses."""

    def turned_left(self) -> 'Direction':
        """Return the direction after a quarter turn to the left."""
        return Direction((self - 1) % 4)

    def turned_right(self) -> 'Direction':
        """Return the direction after a quarter turn to the right."""
        return Direction((self + 1) % 4)


def pack(codes: Iterable[int]) -> bytes:
    """
    Pack codes 0 to 3 into two bits each, four to a byte.

    The first code of a byte is in its two highest bits. The last byte is padded with zeros, so
    the number of codes has to be stored as well.

    Raises
    ------
    ValueError
        A code is not in 0 to 3.

    """
    values = np.fromiter(codes, np.int64)
    wrong = np.flatnonzero((values < 0) | (values > 3))
    if len(wrong):
        raise ValueError(f'code {values[wrong[0]]} at position {wrong[0]} is not in 0 to 3')
    return np.packbits(np.stack([values // 2, values % 2], axis=1).astype(np.uint8)).tobytes()


def unpack(packed: bytes, count: int) -> list[int]:
    """
    Return the first ``count`` codes of the result of ``pack``.

    Raises
    ------
    ValueError
        ``packed`` does not have the length of ``count`` codes.

    """
    expected = -(-count // 4)
    if count < 0 or len(packed) != expected:
        raise ValueError(f'{count} codes take {expected} bytes, not {len(packed)}')
    high, low = np.unpackbits(np.frombuffer(packed, np.uint8)).reshape(-1, 2).T
    codes: list[int] = (2 * high + low)[:count].tolist()
    return codes
