# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The chain code of equal links: a direction for each step of constant length along the way.

So H. Freeman defined chain codes ("On the encoding of arbitrary geometric configurations", 1961),
and so the paper draws its own. A code per pair of frames is that only at constant speed.

A link's direction is the measured heading at its end, quantised. Both are functions of the place
and not of the time, so speed, stops and frame rate do not matter. The turns, which begin and end
at a yaw rate, would not do.
"""

import math
from typing import Any

from phase_traj_ros.core.codes.codes import Direction
from phase_traj_ros.core.codes.freeman import AnyDirection, Freeman
from phase_traj_ros.core.codes.sectors import HeadingSector
from phase_traj_ros.core.codes.series import CodeSeries

LEAST_STEP = 0.1
"""The shortest link, in metres or camera heights."""

# No vehicle goes that far within a pair: a stamp is wrong.
_MOST_OF_A_PAIR = 10_000


class LinkCode:
    """
    Turns heading and distance of each pair of frames into a direction per link.

    Consecutive directions are neighbours: where the heading is more than one sector ahead, the
    next links follow. Standing adds nothing. What is driven in reverse is taken off the way, and
    no link is added until it is made up for: no code means reversing, and none is taken back.
    """

    def __init__(
        self, step: float, *, connectivity: int = 4, max_runs: int | None = None,
    ) -> None:
        """
        Make a code without any links.

        Parameters
        ----------
        step
            Length of a link, in the unit of the distances, ``LEAST_STEP`` or more.
        connectivity
            4 for the paper's directions, 8 for Freeman's.
        max_runs
            Runs that are kept; None keeps all.

        Raises
        ------
        ValueError
            One of them is out of its range.

        """
        if not LEAST_STEP <= step < math.inf:
            raise ValueError(f'step is {step}: give a finite number of {LEAST_STEP} or more')
        self._step = step
        self._sector = HeadingSector(connectivity)
        # Of the four directions, or of the eight.
        self._series: CodeSeries[Any] = CodeSeries(max_runs=max_runs)
        self.reset()

    @property
    def step(self) -> float:
        """Return the length of a link."""
        return self._step

    @property
    def series(self) -> CodeSeries[Direction] | CodeSeries[Freeman]:
        """Return the directions so far, one per link."""
        return self._series

    @property
    def directions(self) -> type[Direction] | type[Freeman]:
        """Return which directions there are: the paper's four, or Freeman's eight."""
        return self._sector.directions

    def reset(self) -> None:
        """Start anew: no links, direction ``FORWARD``."""
        self._series.clear()
        self._sector.reset()
        self._begun = 0.0

    def add(self, distance: float, heading: float, yaw: float) -> tuple[AnyDirection, ...]:
        """
        Take the next pair of frames; return the directions of the links that end in it.

        Parameters
        ----------
        distance
            What the pair adds to the way, negative in reverse.
        heading
            After the pair, in radians since the first frame, left positive, not wrapped.
        yaw
            By how much it has changed in the pair; it is taken to change evenly along the way.

        Raises
        ------
        ValueError
            One of them is NaN or infinite; nothing has changed.

        """
        if not (math.isfinite(distance) and math.isfinite(heading) and math.isfinite(yaw)):
            raise ValueError(
                f'distance is {distance}, heading {heading} and yaw {yaw}: give finite numbers, or'
                ' leave out the pair')
        if abs(distance) > _MOST_OF_A_PAIR * self._step:
            return ()
        self._begun += distance
        ended = []
        while self._begun >= self._step:
            self._begun -= self._step
            self._sector.follow(heading - yaw * self._begun / distance)
            direction = self._sector.direction
            self._series.append(direction)
            ended.append(direction)
        return tuple(ended)
