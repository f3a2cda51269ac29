# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The chain code of equal links: one direction for each step of constant length along the path.

This is the definition of H. Freeman ("On the encoding of arbitrary geometric configurations",
1961), and how the paper draws its codes. One code per pair of frames is equivalent only at
constant speed.

The direction of a link is the measured heading at its end, quantised. Both depend on the position
and not on time, so speed, stops and frame rate have no effect. Turns cannot be used instead: they
begin and end at a yaw rate.
"""

import math
from typing import Any

from phase_traj_ros.core.codes.freeman import AnyDirection
from phase_traj_ros.core.codes.sectors import HeadingSector
from phase_traj_ros.core.codes.series import CodeSeries

MIN_STEP = 0.1
"""Length of the shortest link, in metres or camera heights."""

# Largest number of links in a pair; more are due to a wrong stamp.
_MOST_OF_A_PAIR = 10_000


class LinkCode:
    """
    Turns the heading and distance of each pair of frames into one direction per link.

    Consecutive directions are neighbours: if the heading is more than one sector ahead, the next
    links follow it. A stationary vehicle adds no links. Reversing is subtracted from the distance,
    so no link is added until the vehicle has passed this point again. Links are never removed.
    """

    def __init__(self, step: float, *, connectivity: int = 4, max_runs: int | None = None) -> None:
        """
        Make a code without links.

        Parameters
        ----------
        step
            Length of a link, in the unit of the distances, ``MIN_STEP`` or more.
        connectivity
            4 for the paper's directions, 8 for Freeman's.
        max_runs
            Runs that are kept; None keeps all of them.

        Raises
        ------
        ValueError
            An argument is out of its range.

        """
        if not MIN_STEP <= step < math.inf:
            raise ValueError(f'step is {step}: give a finite number of {MIN_STEP} or more')
        self.step = step
        """Length of a link."""
        self.series: CodeSeries[Any] = CodeSeries(max_runs=max_runs)
        """The directions so far, one per link."""
        self._sector = HeadingSector(connectivity)
        self.directions = self._sector.directions
        """Type of the directions: the paper's four, or Freeman's eight."""
        self._begun = 0.0

    def add(self, distance: float, heading: float, yaw: float) -> tuple[AnyDirection, ...]:
        """
        Add the next pair of frames; return the directions of the links that end in it.

        ``distance`` is that of the pair, negative in reverse. ``heading`` is that after the pair,
        in radians relative to the first frame, positive to the left, not wrapped. ``yaw`` is its
        change in the pair, which is assumed to be even along the path.

        Raises
        ------
        ValueError
            An argument is NaN or infinite. The state is unchanged.

        """
        if not (math.isfinite(distance) and math.isfinite(heading) and math.isfinite(yaw)):
            raise ValueError(
                f'distance is {distance}, heading {heading} and yaw {yaw}: give finite numbers, or'
                ' leave out the pair')
        if abs(distance) > _MOST_OF_A_PAIR * self.step:
            return ()
        self._begun += distance
        ended = []
        while self._begun >= self.step:
            self._begun -= self.step
            self._sector.follow(heading - yaw * self._begun / distance)
            self.series.append(self._sector.direction)
            ended.append(self._sector.direction)
        return tuple(ended)
