# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Freeman's eight directions, and their relation to the four of the paper.

Codes count counter-clockwise in steps of 45 degrees as in H. Freeman, "On the encoding of
arbitrary geometric configurations", 1961. The start heads up, code 2 (the paper's in brackets):

    3      2 (1)   1
    4 (0)    .     0 (2)
    5      6 (3)   7
"""

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


def freeman(direction: AnyDirection) -> Freeman:
    """Return the Freeman code of a direction: the paper's 0, 1, 2, 3 become 4, 2, 0, 6."""
    return Freeman[direction.name]


_TO_FOUR = {freeman(direction): direction for direction in Direction}


def to_four(code: Freeman) -> Direction:
    """Return the paper's direction for a Freeman code; for a diagonal, that nearer to forward."""
    if code in _TO_FOUR:
        return _TO_FOUR[code]
    neighbours = [Freeman((code + step) % 8) for step in (-1, 1)]
    return _TO_FOUR[min(neighbours, key=lambda each: abs(each - Freeman.FORWARD))]
