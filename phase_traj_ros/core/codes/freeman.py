# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Freeman's eight directions, and how they go with the four of the paper.

Counted counter-clockwise in steps of 45 degrees as in H. Freeman, "On the encoding of arbitrary
geometric configurations", 1961, with the start heading up, 2 (in brackets, the paper's codes):

    3      2 (1)   1
    4 (0)    .     0 (2)
    5      6 (3)   7
"""

from types import MappingProxyType
from typing import TypeAlias

from phase_traj_ros.core.codes.codes import Code, Direction


class Freeman(Code):
    """Heading relative to the start, in steps of 45 degrees, counter-clockwise."""

    RIGHT = 0
    FORWARD_RIGHT = 1
    FORWARD = 2
    FORWARD_LEFT = 3
    LEFT = 4
    BACKWARD_LEFT = 5
    BACKWARD = 6
    BACKWARD_RIGHT = 7


AnyDirection: TypeAlias = Direction | Freeman
"""A direction code, one of the paper's four or one of Freeman's eight."""


_OF_FOUR = MappingProxyType({
    Direction.RIGHT: Freeman.RIGHT,
    Direction.FORWARD: Freeman.FORWARD,
    Direction.LEFT: Freeman.LEFT,
    Direction.BACKWARD: Freeman.BACKWARD,
})
_TO_FOUR = MappingProxyType({code: direction for direction, code in _OF_FOUR.items()})


def from_four(direction: Direction) -> Freeman:
    """Return the same direction as one of the eight codes: 0, 1, 2, 3 are 4, 2, 0, 6."""
    return _OF_FOUR[direction]


def to_four(code: Freeman, before: Direction = Direction.FORWARD) -> Direction:
    """
    Return the one of the four codes for one of the eight.

    0, 2, 4 and 6 are the same direction. A diagonal lies between two of the four, and is the one
    of them nearer to ``before``, the direction so far: who has turned by 45 degrees has not turned
    yet. (Of two equally near ones, which are opposite to ``before``, the right one.)
    """
    if code in _TO_FOUR:
        return _TO_FOUR[code]
    here = _OF_FOUR[before]
    neighbours = [_TO_FOUR[Freeman((code + step) % 8)] for step in (-1, 1)]
    return min(neighbours, key=lambda each: min((_OF_FOUR[each] - here) % 8,
                                                (here - _OF_FOUR[each]) % 8))
