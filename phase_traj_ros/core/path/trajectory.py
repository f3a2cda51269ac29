# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Draws the trajectory of direction codes, one step of constant length per code.

Vertices are rows (x, y). There are two sets of axes: those of the figures of the paper (x right,
y up, start heading up) and those of REP 103 (x forward, y left, start heading along x).
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.codes.codes import Direction
from phase_traj_ros.core.codes.freeman import AnyDirection, Freeman, freeman


class Axes(Enum):
    """Axes of a drawn trajectory."""

    FIGURE = 'figure'
    """x to the right, y up: direction 1 is up, 0 left, 2 right, 3 down."""
    REP103 = 'rep103'
    """x forward, y left: direction 1 is +x, 0 is +y, 2 is -y, 3 is -x."""


def unit_step(direction: AnyDirection) -> tuple[float, float]:
    """Return the step (x, y) of length 1 along ``direction``, in REP 103 axes."""
    angle = yaw(direction)
    # The neighbouring cell of a grid; a diagonal one is farther away.
    x, y = round(math.cos(angle)), round(math.sin(angle))
    length = math.sqrt(0.5) if x and y else 1
    return x * length, y * length


def yaw(direction: AnyDirection) -> float:
    """Return the yaw of ``direction`` in radians, positive to the left, 0 for forward."""
    eighths = (freeman(direction) - Freeman.FORWARD + 3) % 8 - 3
    return eighths * math.pi / 4


def vertices(
    directions: Iterable[int], *, axes: Axes = Axes.REP103,
    codes: type[Direction] | type[Freeman] = Direction,
) -> NDArray[np.float64]:
    """
    Return the drawn trajectory, (n + 1, 2) for n directions, which starts at the origin.

    ``codes`` is the type of the directions: the four of the paper, or the eight of Freeman.

    Raises
    ------
    ValueError
        A code is not a direction (0 to 3, or 0 to 7).

    """
    steps = [unit_step(codes(code)) for code in directions]
    return to_axes(np.cumsum([(0.0, 0.0), *steps], axis=0), axes)


def to_axes(points: NDArray[np.float64], axes: Axes) -> NDArray[np.float64]:
    """Convert points (n, 2) from REP 103 axes to ``axes``."""
    if axes is Axes.FIGURE:
        # Forward is up and left is left: (x, y) -> (-y, x), without -0.0.
        return np.column_stack([0.0 - points[:, 1], points[:, 0]])
    return points


def normalised(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Return points (n, 2), translated to start at the origin and scaled to a longer side of 1.

    The aspect ratio is kept. A trajectory without extent stays at the origin.
    """
    moved: NDArray[np.float64] = points - points[0]
    extent = float(np.ptp(moved, axis=0).max())
    if extent > 0:
        moved /= extent
    return moved


@dataclass(frozen=True, slots=True)
class Corner:
    """A pose of the drawn trajectory, in REP 103 axes, in the unit of the path."""

    x: float
    y: float
    yaw: float
    """Yaw of the next step (at the tip: of the last step) in radians, positive to the left."""
    stamp_ns: int


class ChainPath:
    """
    The trajectory drawn from direction codes: its corners and its tip.

    With ``max_corners``, the oldest corners are dropped, so that its size is bounded.
    """

    def __init__(self, *, max_corners: int | None = None) -> None:
        """Make a path that has not started."""
        self._corners: deque[Corner] = deque(maxlen=max_corners)
        self.tip: Corner | None = None
        """The current pose; None before the path has started."""

    def start(self, stamp_ns: int) -> Corner:
        """Start at the origin, heading ``FORWARD``, unless the path has; return its pose."""
        if self.tip is None:
            self.tip = Corner(0, 0, 0.0, stamp_ns)
            self._corners.append(self.tip)
        return self.tip

    def append(self, direction: AnyDirection, stamp_ns: int) -> None:
        """Append one step along ``direction``."""
        tip, angle = self.start(stamp_ns), yaw(direction)
        if angle != tip.yaw:
            if tip == self._corners[-1]:
                self._corners.pop()
            self._corners.append(Corner(tip.x, tip.y, angle, tip.stamp_ns))
        dx, dy = unit_step(direction)
        self.tip = Corner(tip.x + dx, tip.y + dy, angle, stamp_ns)

    @property
    def corners(self) -> tuple[Corner, ...]:
        """Return the start and the kept corners, oldest first, without the tip."""
        return tuple(self._corners)

    def points(self, limit: int) -> tuple[Corner, ...]:
        """Return the newest corners and the tip, at most ``limit`` in total."""
        if self.tip is None:
            return ()
        return (*self.corners[max(len(self._corners) - limit + 1, 0):], self.tip)
