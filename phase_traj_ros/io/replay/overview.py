# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The data that figures and reports show of a replay, and the quality of these data."""

from dataclasses import dataclass, replace
from itertools import pairwise
import math

import cv2
import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core import Movement, PairStatus, Update
from phase_traj_ros.io.replay.run import Replay

LOW_RESPONSE = 0.02
"""Unrelated frames reach a response of 0.014 to 0.021 at 1241 x 376 pixels."""

# An interval of this many usual ones lacks a frame.
_LONG = 1.5


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

    @property
    def intervals(self) -> NDArray[np.float64]:
        """Return the times between two frames."""
        return np.diff(self.seconds, prepend=0.0)

    @property
    def interval_s(self) -> float:
        """Return the median time between two frames."""
        return float(np.median(self.intervals))

    @property
    def missing(self) -> int:
        """Return the number of missing frames, one or more for each long interval."""
        late = self.intervals[self.intervals >= _LONG * self.interval_s]
        return int((np.rint(late / self.interval_s) - 1).clip(1).sum())

    @property
    def median_response(self) -> float:
        """Return the median response; NaN if nothing was measured."""
        measured = self.response[np.isfinite(self.response)]
        return float(np.median(measured)) if len(measured) else math.nan

    @property
    def low_responses(self) -> int:
        """Return the number of pairs with a response below ``LOW_RESPONSE``."""
        return int((self.response < LOW_RESPONSE).sum())


def overview(result: Replay) -> Overview:
    """Return the overview of ``result``."""
    rows = np.fromiter(
        (_row(result, update) for update in result.updates),
        np.dtype((np.float64, 7)), len(result.updates))
    seconds, dx, response, x, y, heading, speed = rows.T
    return Overview(
        seconds=seconds,
        dx=dx,
        response=response,
        path=np.vstack([np.zeros(2), np.column_stack([x, y])]),
        turns=turn_marks(result),
        heading_deg=None if np.isnan(heading).any() else np.degrees(heading),
        speed=speed if result.way.pairs else None,
    )


def _row(result: Replay, update: Update) -> tuple[float, ...]:
    shift, heading, speed = update.shift, update.heading, update.speed
    return (
        _seconds(result, update.stamp_ns),
        *((math.nan, math.nan) if shift is None else (shift.dx, shift.response)),
        update.tip.x, update.tip.y, math.nan if heading is None else heading.heading,
        math.nan if speed is None else speed)


def outline(path: NDArray[np.float64], detail: float) -> NDArray[np.float64]:
    """
    Return the points, (m, 2), that a drawing of a path, (n, 2), needs.

    ``detail`` is the tolerance as a share of the longer side of the path.
    """
    points = path.astype(np.float32).reshape(-1, 1, 2)
    finest = float(np.ptp(points, axis=0).max()) * detail
    return cv2.approxPolyDP(points, finest, closed=False).reshape(-1, 2).astype(np.float64)


def extremes(values: NDArray[np.float64], columns: int) -> NDArray[np.intp]:
    """
    Return the indices of the values, (n,), that a plot of so many columns shows.

    They are the lowest and the highest one in each column, or all if they are few.
    """
    count = len(values)
    if count <= 2 * columns:
        return np.arange(count)
    column = np.arange(count) * columns // count
    starts = np.searchsorted(column, np.arange(columns))
    # NaN is sorted to the end.
    lowest, highest = (np.lexsort((each, column))[starts] for each in (values, -values))
    return np.union1d(lowest, highest)


def turn_marks(result: Replay) -> tuple[TurnMark, ...]:
    """
    Return the turns, oldest first.

    If the codes come from the heading, these are the turns of the heading: a U-turn is two
    changes of the direction and one turn. Otherwise they are those of the movement codes.
    """
    if result.parameters.settings.by_heading:
        return tuple(
            TurnMark(
                number, Movement.LEFT if turn.angle_deg > 0 else Movement.RIGHT,
                turn.start_frame, turn.end_frame - 1, _seconds(result, turn.start_ns),
                _seconds(result, turn.end_ns), turn.angle_deg)
            for number, turn in enumerate(result.turns, 1))
    marks: list[TurnMark] = []
    turning = False
    for before, update in pairwise(result.updates):
        end_s = _seconds(result, update.stamp_ns)
        if update.step.appended:
            turning = update.step.movement is not Movement.FORWARD
            if turning:
                marks.append(TurnMark(
                    len(marks) + 1, update.step.movement, update.pair, update.pair,
                    _seconds(result, before.stamp_ns), end_s, _angle(result, update.pair + 1)))
        elif turning and update.status is PairStatus.TURNING:
            # So pairs before it that could not be judged belong to the turn.
            marks[-1] = replace(marks[-1], end_pair=update.pair, end_s=end_s)
    return tuple(marks)


def _angle(result: Replay, frame: int) -> float | None:
    """Return the angle of the measured turn that a frame belongs to."""
    return next((
        turn.angle_deg for turn in result.turns if turn.start_frame <= frame <= turn.end_frame),
        None)


def _seconds(result: Replay, stamp_ns: int) -> float:
    """Return the time since the first frame."""
    return (stamp_ns - result.first_stamp_ns) / 1e9
