# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The data that figures and reports show of a replay, computed once for all of them."""

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Movement, PairStatus
from phase_traj_ros.io.replay.run import Replay


@dataclass(frozen=True, slots=True)
class TurnMark:
    """A turn, as marked in figures."""

    number: int
    """Number of the turn, from 1 on."""
    side: Movement
    """LEFT or RIGHT."""
    pair: int
    """The pair on which it begins."""
    end_pair: int
    """The last pair that belongs to it."""
    start_s: float
    """Time of the first frame of ``pair``, in seconds since the first frame."""
    end_s: float
    """Time of the second frame of ``end_pair``."""
    corner: tuple[float, float]
    """Position on the drawn path, in its unit, REP 103 axes."""
    angle_deg: float | None = None
    """Angle by which the camera turned, positive to the left; None if it was not measured."""


@dataclass(frozen=True, slots=True)
class Overview:
    """
    The series of a replay over time, one value per pair of frames, and its turns.

    ``seconds`` are the times since the first frame. Missing measurements are NaN. ``path`` is the
    drawn path, (n + 1, 2) for n pairs, in its unit, REP 103 axes. ``heading_deg`` is the heading
    since the start, positive to the left, and ``speed`` is in metres or camera heights per second;
    each is None if it was not measured.
    """

    seconds: NDArray[np.float64]
    dx: NDArray[np.float64]
    response: NDArray[np.float64]
    path: NDArray[np.float64]
    turns: tuple[TurnMark, ...]
    heading_deg: NDArray[np.float64] | None = None
    speed: NDArray[np.float64] | None = None


def overview(result: Replay) -> Overview:
    """Return the overview of ``result``."""
    nothing = math.nan, math.nan
    shown = np.array([
        (update.tip.x, update.tip.y,
         *(nothing if update.shift is None else (update.shift.dx, update.shift.response)))
        for update in result.updates], np.float64)
    return Overview(
        seconds=(_stamps(result)[1:] - result.first_stamp_ns) / 1e9,
        dx=shown[:, 2],
        response=shown[:, 3],
        path=np.vstack([np.zeros(2), shown[:, :2]]),
        turns=turn_marks(result),
        heading_deg=_heading(result),
        speed=_speed(result),
    )


def _heading(result: Replay) -> NDArray[np.float64] | None:
    headings = [update.heading.heading for update in result.updates if update.heading]
    return np.degrees(headings) if len(headings) == len(result.updates) else None


def _speed(result: Replay) -> NDArray[np.float64] | None:
    if not result.way.pairs:
        return None
    speeds = (update.speed for update in result.updates)
    return np.array([np.nan if speed is None else speed for speed in speeds])


def _angle(result: Replay, frame: int) -> float | None:
    """Return the angle of the measured turn that a frame belongs to."""
    return next((
        turn.angle_deg for turn in result.turns if turn.start_frame <= frame <= turn.end_frame),
        None)


def turn_marks(result: Replay) -> tuple[TurnMark, ...]:
    """
    Return the turns, oldest first.

    If the codes come from the heading, these are the turns of the heading: a U-turn is two
    changes of the direction and one turn. Otherwise they are those of the movement codes.
    """
    if result.parameters.codes_from_heading:
        return _marks_of_heading(result)
    updates = result.updates
    seconds = (_stamps(result) - result.first_stamp_ns) / 1e9
    marks: list[TurnMark] = []
    for pair, update in enumerate(updates):
        if update.step.movement not in (Movement.LEFT, Movement.RIGHT):
            continue
        end = pair
        # During a turn there may be pairs that could not be judged.
        for later in range(pair + 1, len(updates)):
            if updates[later].step.appended:
                break
            if updates[later].status is PairStatus.TURNING:
                end = later
        before = updates[pair - 1].tip
        marks.append(TurnMark(
            len(marks) + 1, update.step.movement, pair, end, float(seconds[pair]),
            float(seconds[end + 1]), (before.x, before.y), _angle(result, pair + 1)))
    return tuple(marks)


def _marks_of_heading(result: Replay) -> tuple[TurnMark, ...]:
    tips = [(0.0, 0.0), *((update.tip.x, update.tip.y) for update in result.updates)]
    return tuple(
        TurnMark(
            number, Movement.LEFT if turn.angle_deg > 0 else Movement.RIGHT, turn.start_frame,
            turn.end_frame - 1, (turn.start_ns - result.first_stamp_ns) / 1e9,
            (turn.end_ns - result.first_stamp_ns) / 1e9, tips[turn.start_frame], turn.angle_deg)
        for number, turn in enumerate(result.turns, 1))


def _stamps(result: Replay) -> NDArray[np.int64]:
    """Return the stamps of all frames in nanoseconds, (pairs + 1,)."""
    return np.array(
        [result.first_stamp_ns, *(update.stamp_ns for update in result.updates)], np.int64)
