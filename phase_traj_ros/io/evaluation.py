# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How good a replay's turns, heading, codes and drawing are, measured against the truth."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import csv
from dataclasses import asdict, dataclass
from decimal import Decimal
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.codes import Direction, Movement
from phase_traj_ros.core.freeman import AnyDirection, Freeman
from phase_traj_ros.core.heading_code import HeadingCode
from phase_traj_ros.core.trajectory import vertices
from phase_traj_ros.core.turns import find_turns, MIN_ANGLE_DEG, Turn
from phase_traj_ros.errors import ResultError
from phase_traj_ros.io.ground_truth import GroundTruth, match, MatchedTruth

# Turns this close to the least angle, to either side, count neither way.
_MARGIN_DEG = 5.0
# A turn may be found by so much earlier or later than it is, nanoseconds.
_TOLERANCE_NS = 1_000_000_000
_STRETCH_M = 100.0
_NO_STEP = ('still', 'gap', 'no_measurement', 'reprimed')


@dataclass(frozen=True, slots=True)
class TurnScore:
    """
    The turns found against the true ones.

    precision
        Share of the turns found that are true; 1 where none was found.
    recall
        Share of the true turns that were found; 1 where there are none.
    found, true
        How many there are of each, without those that count neither way.
    angle_error_deg
        Root mean square of the angles' errors, of the turns found that are true.
    """

    precision: float
    recall: float
    found: int
    true: int
    angle_error_deg: float | None


@dataclass(frozen=True, slots=True)
class DirectionScore:
    """
    The direction codes against the true heading, quantised in the same way.

    agreement
        Share of the frames at which both directions are the same.
    changes, true_changes
        The sequences of left and right turns (0 and 2) that the codes make.
    same_changes
        Whether they are the same.
    """

    agreement: float
    changes: tuple[int, ...]
    true_changes: tuple[int, ...]
    same_changes: bool


@dataclass(frozen=True, slots=True)
class HeadingError:
    """
    Errors of the heading in degrees, which is 0 at the first frame in both.

    rms, end, max
        Root mean square over the frames, at the last one (with its sign), the largest.
    per_100m
        Mean size of the error gained on stretches of 100 m (on all of a shorter drive, scaled).
    per_frame_rms
        Root mean square of the error gained from frame to frame.
    """

    rms: float
    end: float
    max: float  # noqa: A003
    per_100m: float | None
    per_frame_rms: float


@dataclass(frozen=True, slots=True)
class ShapeError:
    """
    Distance of the drawn path from the true one, as a share of the latter's longer side.

    Root mean square over the frames, after the similarity transform that fits them best. None
    where there is nothing to draw it from.
    """

    codes: float | None
    heading: float | None
    path: float | None
    """Of the path as the replay has written it: from either, or in metres by the speed."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """All figures of one replay; None where the replay does not hold what they take."""

    frames: int
    """Frames that the truth covers."""
    length_m: float
    turns: TurnScore | None
    direction: DirectionScore
    heading_error_deg: HeadingError | None
    shape_error: ShapeError

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as they stand in ``evaluation.json``."""
        return asdict(self)


@dataclass(frozen=True, slots=True, eq=False)
class ReplayedDrive:
    """
    What a replay's directory holds of a drive, as far as it can be compared with the truth.

    stamps_ns
        (n,) of the frames.
    movement, direction
        The codes.
    status
        One per pair.
    connectivity
        In how many directions the codes have quantised the heading, 4 or 8.
    heading
        (n,) radians, left positive, not wrapped; None where the replay did not measure it.
    turns
        The turns found; None likewise.
    """

    source: str
    stamps_ns: NDArray[np.int64]
    movement: tuple[Movement, ...]
    direction: tuple[AnyDirection, ...]
    status: tuple[str, ...]
    connectivity: int
    heading: NDArray[np.float64] | None
    turns: tuple[Turn, ...] | None
    path: NDArray[np.float64] | None
    """(n, 2), as it stands in ``trajectory.tum``; None where that is missing."""

    @property
    def directions(self) -> type[Direction] | type[Freeman]:
        """Return which directions there are."""
        return Freeman if self.connectivity == 8 else Direction

    @property
    def direction_at(self) -> NDArray[np.int64]:
        """Return the direction at each frame, (n,)."""
        appended = iter(self.direction)
        current: AnyDirection = self.directions.FORWARD
        found = [current]
        for movement in self.movement:
            if movement is not Movement.NO_CHANGE:
                current = next(appended)
            found.append(current)
        return np.array(found, np.int64)

    def drawn_from_codes(self) -> NDArray[np.float64]:
        """Return where the path drawn from the codes has got to at each frame, (n, 2)."""
        steps = np.array([movement is not Movement.NO_CHANGE for movement in self.movement])
        reached = np.concatenate([[0], np.cumsum(steps)])
        return np.asarray(vertices(self.direction, codes=self.directions)[reached])

    def drawn_from_heading(self) -> NDArray[np.float64] | None:
        """Return the same with a unit step along the measured heading, in REP 103 axes."""
        if self.heading is None:
            return None
        length = np.array([status not in _NO_STEP for status in self.status], np.float64)
        middle = (self.heading[1:] + self.heading[:-1]) / 2
        steps = np.stack([length * np.cos(middle), length * np.sin(middle)], axis=1)
        return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def read_replay(directory: Path) -> ReplayedDrive:
    """
    Return what ``phase_traj replay --output`` has written to a directory.

    Raises
    ------
    ResultError
        It has not, or the files do not fit together.

    """
    try:
        content = json.loads((directory / 'chain_code.json').read_text(encoding='utf-8'))
        with (directory / 'shifts.csv').open(encoding='utf-8', newline='') as file:
            stamps = [round(Decimal(row['stamp']) * 10**9) for row in csv.DictReader(file)]
        heading = content.get('heading_deg')
        connectivity = int(content.get('connectivity', 4))
        directions = Freeman if connectivity == 8 else Direction
        drive = ReplayedDrive(
            source=str(content['source']),
            stamps_ns=np.array([int(content['first_stamp_ns']), *stamps], np.int64),
            movement=tuple(Movement(code) for code in content['movement']),
            direction=tuple(directions(code) for code in content['direction']),
            status=tuple(content['status']), connectivity=connectivity,
            heading=None if heading is None else np.radians(np.array(heading, np.float64)),
            turns=_read_turns(content.get('turns')), path=_read_path(directory))
    except OSError as error:
        raise ResultError(
            f'{directory} holds no replay ({error.strerror}: {error.filename}): write one with'
            ' phase_traj replay --output') from None
    except (ArithmeticError, KeyError, TypeError, ValueError) as error:
        raise ResultError(
            f'{directory} does not hold what phase_traj replay writes ({type(error).__name__}:'
            f' {error}): replay again') from None
    pairs = len(drive.stamps_ns) - 1
    appended = pairs - drive.movement.count(Movement.NO_CHANGE)
    if not (pairs >= 1 and pairs == len(drive.movement) == len(drive.status)
            and len(drive.direction) == appended
            and all(each is None or len(each) == pairs + 1
                    for each in (drive.heading, drive.path))):
        raise ResultError(
            f'{directory}: chain_code.json, shifts.csv and trajectory.tum do not fit together:'
            ' replay again')
    return drive


def evaluate(drive: ReplayedDrive, truth: GroundTruth) -> tuple[Evaluation, MatchedTruth]:
    """
    Return the figures of a replay, and the truth at its frames.

    Raises
    ------
    ResultError
        The truth does not cover the replay.

    """
    true = match(truth, drive.stamps_ns)
    steps = np.hypot(*np.diff(true.positions, axis=0).T)
    heading = None
    if drive.heading is not None:
        heading = heading_error(drive.heading[true.frames], true)
    drawn = drive.drawn_from_heading()
    return Evaluation(
        frames=len(true.frames),
        length_m=float(steps.sum()),
        turns=None if drive.turns is None else turn_score(drive.turns, true),
        direction=_direction_score(drive, true),
        heading_error_deg=heading,
        shape_error=ShapeError(
            codes=_shape_error(drive.drawn_from_codes()[true.frames], true.positions),
            heading=None if drawn is None else _shape_error(
                drawn[true.frames], true.positions),
            path=None if drive.path is None else _shape_error(
                drive.path[true.frames], true.positions)),
    ), true


def write_evaluation(
    evaluation: Evaluation, path: Path, *, source: str, ground_truth: str,
) -> None:
    """Write the figures as JSON; docs/files.md lists the keys."""
    content = {'source': source, 'ground_truth': ground_truth, **evaluation.as_dict()}
    path.write_text(json.dumps(content, indent=2) + '\n', encoding='utf-8')


def true_turns(true: MatchedTruth) -> list[Turn]:
    """Return the turns of the truth, those a little below the least angle included."""
    return find_turns(
        true.stamps_ns.tolist(), true.headings.tolist(), min_angle_deg=MIN_ANGLE_DEG - _MARGIN_DEG)


def aligned(points: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Return points (n, 2) moved, turned and scaled, not mirrored, to fit the target (n, 2) best.

    The least squares solution of S. Umeyama, "Least-squares estimation of transformation
    parameters between two point patterns", 1991, written with complex numbers.
    """
    source, wanted = (
        side[:, 0] + 1j * side[:, 1] for side in (points, target))
    middle = source.mean()
    moved = source - middle
    power = float(np.vdot(moved, moved).real)
    factor = np.vdot(moved, wanted) / power if power > 0 else 0.0
    fitted = factor * moved + wanted.mean()
    return np.stack([fitted.real, fitted.imag], axis=1)


def _read_path(directory: Path) -> NDArray[np.float64] | None:
    file = directory / 'trajectory.tum'
    if not file.exists():
        return None
    rows = [line.split()[1:3] for line in file.read_text(encoding='utf-8').splitlines()]
    return np.array(rows, np.float64).reshape(-1, 2)


def _read_turns(turns: Iterable[Mapping[str, Any]] | None) -> tuple[Turn, ...] | None:
    if turns is None:
        return None
    return tuple(
        Turn(
            start_frame=int(turn['start_frame']), end_frame=int(turn['end_frame']),
            start_ns=round(float(turn['start']) * 1e9), end_ns=round(float(turn['end']) * 1e9),
            angle_deg=float(turn['angle_deg']), peak_rate_deg_s=float(turn['peak_rate_deg_s']))
        for turn in turns)


def turn_score(found: Sequence[Turn], true: MatchedTruth) -> TurnScore:
    """
    Return how the turns found go with the true ones.

    Those near the least angle are neither missed nor invented.
    """
    begin, end = true.stamps_ns[[0, -1]].tolist()
    covered = [turn for turn in found if begin <= turn.end_ns and turn.start_ns <= end]
    there = true_turns(true)
    clear = MIN_ANGLE_DEG + _MARGIN_DEG
    clear_there = [
        index for index, turn in enumerate(there) if abs(turn.angle_deg) >= clear]
    partners = _partners(covered, there)
    right = sum(index in clear_there for index in partners.values())
    # Of a turn of which the truth knows a part only, it cannot be said that it is wrong.
    wrong = sum(
        number not in partners and abs(turn.angle_deg) >= clear
        and begin <= turn.start_ns and turn.end_ns <= end
        for number, turn in enumerate(covered))
    errors = [
        covered[number].angle_deg - there[index].angle_deg for number, index in partners.items()]
    return TurnScore(
        precision=right / (right + wrong) if right + wrong else 1.0,
        recall=right / len(clear_there) if clear_there else 1.0,
        found=right + wrong, true=len(clear_there),
        angle_error_deg=_rms(np.array(errors)) if errors else None)


def _partners(found: Sequence[Turn], there: Sequence[Turn]) -> dict[int, int]:
    """Return which turn found is which true one, to the same side and within a second."""
    overlaps = sorted(
        ((_overlap_ns(turn, other), number, index)
         for number, turn in enumerate(found) for index, other in enumerate(there)
         if turn.angle_deg * other.angle_deg > 0), reverse=True)
    partners: dict[int, int] = {}
    for overlap, number, index in overlaps:
        if (overlap >= -_TOLERANCE_NS and number not in partners
                and index not in partners.values()):
            partners[number] = index
    return partners


def _overlap_ns(turn: Turn, other: Turn) -> int:
    """Return for how long both last, negative for how long there is neither between them."""
    return min(turn.end_ns, other.end_ns) - max(turn.start_ns, other.start_ns)


def _direction_score(drive: ReplayedDrive, true: MatchedTruth) -> DirectionScore:
    codes = HeadingCode(connectivity=drive.connectivity)
    rates = np.diff(true.headings) / np.diff(true.stamps_ns) * 1e9
    there: list[AnyDirection] = [drive.directions.FORWARD]
    for heading, rate in zip(true.headings[1:].tolist(), rates.tolist()):
        there.append(codes.update(heading, rate).direction)
    found = drive.direction_at[true.frames]
    # The truth starts with the direction forward wherever it starts.
    offset = found[0] - drive.directions.FORWARD
    changes = _changes(drive.movement[frame - 1] for frame in true.frames[1:].tolist())
    true_changes = _changes(codes.movement)
    return DirectionScore(
        agreement=float(np.mean((found - offset) % drive.connectivity == np.array(there))),
        changes=changes, true_changes=true_changes, same_changes=changes == true_changes)


def _changes(movement: Iterable[Movement]) -> tuple[int, ...]:
    return tuple(
        int(code) for code in movement if code in (Movement.LEFT, Movement.RIGHT))


def heading_error(heading: NDArray[np.float64], true: MatchedTruth) -> HeadingError:
    """Return the errors of a heading, (M,) radians at the frames of the truth."""
    error = np.degrees(heading - heading[0] - true.headings)
    return HeadingError(
        rms=_rms(error), end=float(error[-1]), max=float(np.abs(error).max()),
        per_100m=_per_100m(error, true.positions), per_frame_rms=_rms(np.diff(error)))


def _per_100m(error: NDArray[np.float64], positions: NDArray[np.float64]) -> float | None:
    """Return the mean size of the error gained on each stretch of 100 m."""
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(positions, axis=0).T))])
    if way[-1] == 0.0:
        return None
    ends = np.searchsorted(way, way + _STRETCH_M)
    starts = np.flatnonzero(ends < len(way))
    if not len(starts):
        return abs(float(error[-1])) / float(way[-1]) * _STRETCH_M
    return float(np.abs(error[ends[starts]] - error[starts]).mean())


def _shape_error(drawn: NDArray[np.float64], true: NDArray[np.float64]) -> float | None:
    extent = float(np.ptp(true, axis=0).max())
    if extent == 0.0 or len(drawn) < 2:
        return None
    off = aligned(drawn, true) - true
    return _rms(np.hypot(off[:, 0], off[:, 1])) / extent


def _rms(values: NDArray[np.float64]) -> float:
    return math.sqrt(float(np.mean(np.square(values))))
