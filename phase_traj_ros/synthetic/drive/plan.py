# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A drive as a list of segments, and the smooth motion that follows them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
import math
from typing import TypeAlias

import numpy as np
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.synthetic.arrays import Floats

#: Share of a turn in which the yaw rate rises, and in which it falls.
_RAMP = 0.25
#: Duration of a change of speed, in seconds.
_SPEED_CHANGE = 1.0
#: Integration step of the path, in seconds.
_STEP = 0.002


@dataclass(frozen=True, slots=True)
class Straight:
    """
    Straight ahead for ``seconds``.

    ``speed`` is in m/s, negative in reverse, 0 for a stop; None for that of the drive.
    """

    seconds: float
    speed: float | None = None

    angle_deg = 0.0


@dataclass(frozen=True, slots=True)
class Turn:
    """
    A turn by ``angle_deg``, positive to the left, within ``seconds``.

    The yaw rate rises and falls smoothly and is constant between; its peak is 4 / 3 of its mean.
    """

    angle_deg: float
    seconds: float = 3.0
    speed: float | None = None


Plan: TypeAlias = Sequence[Straight | Turn]


def borders(plan: Plan) -> list[float]:
    """Return the times in seconds at which segments begin, and at last the end of the plan."""
    return list(accumulate((segment.seconds for segment in plan), initial=0.0))


def check(plan: Plan, speed: float) -> None:
    """Raise `ParameterError` if the plan cannot be driven."""
    if not plan:
        raise ParameterError('a plan needs at least one segment')
    for segment in plan:
        if not (math.isfinite(segment.seconds) and segment.seconds > 0
                and math.isfinite(segment.angle_deg)):
            raise ParameterError(
                f'{segment}: a segment needs a positive duration and a finite angle')
        wanted = speed if segment.speed is None else segment.speed
        if not math.isfinite(wanted):
            raise ParameterError(f'the speed is {wanted} m/s: give a finite number')


def _turned(progress: Floats) -> Floats:
    """Return the completed share of a turn after a share ``progress`` of its time."""
    ramp = np.clip(progress / _RAMP, 0.0, 1.0)
    out = np.clip((1.0 - progress) / _RAMP, 0.0, 1.0)
    level = np.clip(progress, _RAMP, 1.0 - _RAMP) - _RAMP

    def area(share: Floats) -> Floats:
        """Return the integral of a raised cosine that rises from 0 to 1, up to ``share``."""
        return _RAMP * (share / 2 - np.sin(math.pi * share) / (2 * math.pi))

    done: Floats = area(ramp) + level + _RAMP / 2 - area(out)
    return done / (1.0 - _RAMP)


def _speeds(plan: Plan, speed: float) -> tuple[list[float], list[float]]:
    """Return times and speeds, linear in between: brake before a segment, accelerate after it."""
    wanted = [speed if segment.speed is None else segment.speed for segment in plan]
    (times, speeds) = ([0.0], [wanted[0]])
    for (start, (before, after), (old, new)) in zip(
            borders(plan)[1:], pairwise(plan), pairwise(wanted)):
        if new < old:
            (begin, end) = (start - min(_SPEED_CHANGE, before.seconds / 2), start)
        else:
            (begin, end) = (start, start + min(_SPEED_CHANGE, after.seconds / 2))
        times += [begin, end]
        speeds += [old, new]
    return (times, speeds)


def drive_plan(plan: Plan, times: Floats, *, speed: float) -> Floats:
    """
    Return the positions of a vehicle that follows a plan, (N, 3): x, y, yaw.

    ``plan`` and ``speed`` are as `check` accepts them.
    ``times`` (N,) are in seconds from the start, rising. Before and after the plan the vehicle
    goes straight ahead. It starts at the origin, along x. x and y are in metres, yaw in radians.
    ``speed`` in m/s applies to segments without a speed. The vehicle brakes before a slower
    segment and accelerates after it.
    """
    # The midpoints of short steps, and their ends.
    count = max(math.ceil(max(float(times[-1]), 0.0) / _STEP), 1)
    ends = np.linspace(0.0, max(float(times[-1]), _STEP), count + 1)
    middles = (ends[:-1] + ends[1:]) / 2

    def yaw(at: Floats) -> Floats:
        total = np.zeros(len(at))
        for (start, segment) in zip(borders(plan), plan):
            if segment.angle_deg:
                progress = np.clip((at - start) / segment.seconds, 0.0, 1.0)
                total += math.radians(segment.angle_deg) * _turned(progress)
        return total

    step = np.interp(middles, *_speeds(plan, speed)) * (ends[1] - ends[0])
    heading = yaw(middles)
    path = [
        np.interp(times, ends, np.concatenate([[0.0], np.cumsum(step * share)]))
        for share in (np.cos(heading), np.sin(heading))]
    return np.stack([*path, yaw(times)], axis=1)
