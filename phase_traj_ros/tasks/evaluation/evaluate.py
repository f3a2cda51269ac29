# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Scores the turns, heading, codes and path of a replay against the ground truth."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
import json
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.codes.codes import Movement
from phase_traj_ros.core.codes.from_heading import HeadingCode
from phase_traj_ros.errors import ResultError
from phase_traj_ros.tasks.evaluation import scores
from phase_traj_ros.tasks.evaluation.ground_truth import (
    faces_its_way,
    GroundTruth,
    match,
    MatchedTruth,
)
from phase_traj_ros.tasks.evaluation.replayed_drive import ReplayedDrive


@dataclass(frozen=True, slots=True)
class DirectionScore:
    """
    The direction codes compared with the true heading, quantised in the same way.

    agreement
        Share of the frames at which both directions are equal.
    changes, true_changes
        The sequences of left and right turns (0 and 2) that the codes make.
    same_changes
        Whether both sequences are equal.
    """

    agreement: float
    changes: tuple[int, ...]
    true_changes: tuple[int, ...]
    same_changes: bool


@dataclass(frozen=True, slots=True)
class ShapeError:
    """
    Distance of the drawn path from the true one, as a share of the longer side of the true path.

    Root mean square over the frames, after the similarity transform that fits best. None if there
    is no such path.
    """

    codes: float | None
    heading: float | None
    path: float | None
    """Of the path as written by the replay: from codes or heading, or in metres by the speed."""


@dataclass(frozen=True, slots=True)
class PathErrors:
    """
    Errors of the path as written by the replay, in the plane.

    All but ``ate_scaled_m`` need a path in metres, and are None for any other.

    scored_in
        That the height is ignored.
    distance_error_percent
        Error of its length, negative if the path is too short.
    t_rel_percent, r_rel_deg_per_100m
        Mean errors over parts of 100, 200, ... 800 m, see ``relative_errors``. Also None if the
        drive is shorter than the shortest part.
    ate_m, ate_scaled_m
        Root mean square distance from the true path, after the best fit by a rotation and a
        translation, and after the best fit that also scales the path.
    """

    scored_in: str = 'plane'
    distance_error_percent: float | None = None
    t_rel_percent: float | None = None
    r_rel_deg_per_100m: float | None = None
    ate_m: float | None = None
    ate_scaled_m: float | None = None


@dataclass(frozen=True, slots=True)
class Evaluation:
    """All scores of one replay; None where the replay lacks the data."""

    frames: int
    """Frames that the ground truth covers."""
    length_m: float
    turns: scores.TurnScore | None
    direction: DirectionScore
    heading_error_deg: scores.HeadingError | None
    shape_error: ShapeError
    path_errors: PathErrors


def evaluate(
    drive: ReplayedDrive, truth: GroundTruth, *, align_start: bool = False,
) -> tuple[Evaluation, MatchedTruth]:
    """
    Return the scores of a replay, and the ground truth at its frames.

    With ``align_start``, the first pose belongs to the first frame, whatever their times.

    Raises
    ------
    ResultError
        The ground truth does not cover the replay, or does not fit it.

    """
    if not faces_its_way(truth):
        raise ResultError(
            'the poses of the ground truth do not face where they move: give the orientations of'
            ' the vehicle, qx qy qz qw in a TUM file')
    true = match(
        truth, drive.stamps_ns, numbers=drive.frame_numbers, counts=drive.source_frames,
        align_start=align_start)

    def shape(drawn: NDArray[np.float64] | None) -> float | None:
        return None if drawn is None else scores.shape_error(drawn[true.frames], true.positions)

    return Evaluation(
        frames=len(true.frames),
        length_m=float(scores.way_along(true.positions)[-1]),
        turns=None if drive.turns is None else scores.turn_score(drive.turns, true),
        direction=_direction_score(drive, true),
        heading_error_deg=None if drive.heading is None else scores.heading_error(
            drive.heading[true.frames], true),
        shape_error=ShapeError(
            codes=shape(drive.drawn_from_codes()), heading=shape(drive.drawn_from_heading()),
            path=shape(drive.path)),
        path_errors=_path_errors(drive, true),
    ), true


def write_evaluation(
    evaluation: Evaluation, path: Path, *, source: str, ground_truth: str,
) -> None:
    """Write the scores as JSON; docs/reference/files.md lists the keys."""
    content = {'source': source, 'ground_truth': ground_truth, **asdict(evaluation)}
    content |= content.pop('path_errors')
    path.write_text(json.dumps(content, indent=2) + '\n', encoding='utf-8')


def _path_errors(drive: ReplayedDrive, true: MatchedTruth) -> PathErrors:
    if drive.poses is None:
        return PathErrors()
    found = drive.poses[true.frames]
    there = np.column_stack([true.positions, true.headings])
    scaled = scores.absolute_error(found[:, :2], true.positions)
    if not drive.metric:
        return PathErrors(ate_scaled_m=scaled)
    distance = scores.distance_error(found[:, :2], true.positions)
    gained = scores.relative_errors(found, there)
    return PathErrors(
        distance_error_percent=None if distance is None else 100.0 * distance,
        t_rel_percent=None if gained is None else 100.0 * gained.translation,
        r_rel_deg_per_100m=None if gained is None else 100.0 * math.degrees(gained.rotation),
        ate_m=scores.absolute_error(found[:, :2], true.positions, scaled=False),
        ate_scaled_m=scaled)


def _direction_score(drive: ReplayedDrive, true: MatchedTruth) -> DirectionScore:
    codes = HeadingCode(connectivity=len(drive.directions))
    rates = np.diff(true.headings) / np.diff(true.stamps_ns) * 1e9
    there = [drive.directions.FORWARD, *(
        codes.update(heading, rate).direction
        for heading, rate in zip(true.headings[1:].tolist(), rates.tolist()))]
    found = drive.direction_at[true.frames]
    # The ground truth starts with the direction forward, at whichever frame it starts.
    offset = found[0] - drive.directions.FORWARD
    changes = _changes(drive.movement[frame - 1] for frame in true.frames[1:].tolist())
    true_changes = _changes(codes.movement)
    return DirectionScore(
        agreement=float(np.mean((found - offset) % len(drive.directions) == np.array(there))),
        changes=changes, true_changes=true_changes, same_changes=changes == true_changes)


def _changes(movement: Iterable[Movement]) -> tuple[int, ...]:
    return tuple(int(code) for code in movement if code in (Movement.LEFT, Movement.RIGHT))
