# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The two codes of the method, and their packed form."""

from collections.abc import Iterable
from enum import IntEnum

_CODES_PER_BYTE = 4


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
    packed = bytearray()
    for index, code in enumerate(codes):
        if not 0 <= code <= 3:
            raise ValueError(f'code {code} at position {index} is not in 0 to 3')
        place = index % _CODES_PER_BYTE
        if place == 0:
            packed.append(0)
        packed[-1] |= code << (6 - 2 * place)
    return bytes(packed)


def unpack(packed: bytes, count: int) -> list[int]:
    """
    Return the first ``count`` codes of the result of ``pack``.

    Raises
    ------
    ValueError
        ``packed`` does not have the length of ``count`` codes.

    """
    expected = -(-count // _CODES_PER_BYTE)
    if count < 0 or len(packed) != expected:
        raise ValueError(f'{count} codes take {expected} bytes, not {len(packed)}')
    return [packed[index // 4] >> (6 - 2 * (index % 4)) & 3 for index in range(count)]
