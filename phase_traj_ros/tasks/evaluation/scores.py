# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Scores of turns, headings, drawn paths and odometry against the ground truth.

All errors are in the plane. In three dimensions each slope would count as an error of a planar
path: a perfect one would be off by 1.4 to 2.5 %.
"""

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.camera.tuning import TUNING as CAMERA
from phase_traj_ros.core.heading.tuning import TUNING
from phase_traj_ros.core.heading.turns import find_turns, Turn
from phase_traj_ros.tasks.evaluation.ground_truth import MatchedTruth

# Turns within this margin of the smallest angle of a turn are not scored.
_MARGIN_DEG = 5.0
# Tolerance of the time of a turn, in nanoseconds.
_TOLERANCE_NS = 1_000_000_000
_STRETCH_M = 100.0
# Lengths of the parts over which odometry is scored.
_LENGTHS_M = (100, 200, 300, 400, 500, 600, 700, 800)
# For shorter drives, shorter parts are included.
_SHORT_DRIVE_M = 200.0
_SHORT_M = 50
# Number of frames between the starts of two parts.
_EVERY = 10


@dataclass(frozen=True, slots=True)
class TurnScore:
    """
    The turns found, compared with the true ones.

    precision
        Share of the turns found that are true; 1 if none was found.
    recall
        Share of the true turns that were found; 1 if there are none.
    found, true
        Numbers of turns, without those that are not scored.
    angle_error_deg
        Root mean square error of the angles of the correct turns.
    """

    precision: float
    recall: float
    found: int
    true: int
    angle_error_deg: float | None


@dataclass(frozen=True, slots=True)
class HeadingError:
    """
    Errors of the heading in degrees; both headings are 0 at the first frame.

    rms, end, max
        Root mean square over the frames, error at the last one (with its sign), largest error.
    per_100m
        Mean absolute growth of the error over 100 m (a shorter drive is scaled to 100 m).
    per_frame_rms
        Root mean square of the growth of the error from frame to frame.
    """

    rms: float
    end: float
    max: float  # noqa: A003
    per_100m: float | None
    per_frame_rms: float


@dataclass(frozen=True, slots=True)
class RelativeErrors:
    """
    Mean errors over parts of a drive, as in KITTI's odometry benchmark, but in the plane.

    translation
        Distance between the estimated and the true end of a part, as a share of its true length.
    rotation
        Absolute error of the heading at the end of a part, in radians per metre of true length.
    """

    translation: float
    rotation: float


def true_turns(true: MatchedTruth) -> list[Turn]:
    """Return the true turns, including those slightly below the smallest angle of a turn."""
    ways = way_along(true.positions) / CAMERA.usual_height
    return find_turns(
        true.stamps_ns.tolist(), true.headings.tolist(), ways.tolist(),
        min_angle_deg=TUNING.turn_deg - _MARGIN_DEG)


def turn_score(found: Sequence[Turn], true: MatchedTruth) -> TurnScore:
    """
    Compare the turns found with the true ones.

    Turns near the smallest angle count neither as missed nor as invented.
    """
    begin, end = true.stamps_ns[[0, -1]].tolist()
    covered = [turn for turn in found if begin <= turn.end_ns and turn.start_ns <= end]
    there = true_turns(true)
    clear = TUNING.turn_deg + _MARGIN_DEG
    clear_there = [index for index, turn in enumerate(there) if abs(turn.angle_deg) >= clear]
    partners = _partners(covered, there)
    right = sum(index in clear_there for index in partners.values())
    # A turn that the ground truth covers only in part cannot be called wrong.
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


def heading_error(heading: NDArray[np.float64], true: MatchedTruth) -> HeadingError:
    """Return the errors of a heading, (M,) radians at the frames of the ground truth."""
    error = np.degrees(heading - heading[0] - true.headings)
    return HeadingError(
        rms=_rms(error), end=float(error[-1]), max=float(np.abs(error).max()),
        per_100m=_per_100m(error, true.positions), per_frame_rms=_rms(np.diff(error)))


def aligned(
    points: NDArray[np.float64], target: NDArray[np.float64], *, scaled: bool = True,
) -> NDArray[np.float64]:
    """
    Fit points (n, 2) to the target (n, 2) by translation, rotation and scale; return them.

    Without ``scaled`` they keep their size. They are not mirrored. This is the least-squares
    solution of S. Umeyama, "Least-squares estimation of transformation parameters between two
    point patterns", 1991, written with complex numbers.
    """
    source, wanted = (side[:, 0] + 1j * side[:, 1] for side in (points, target))
    middle = source.mean()
    moved = source - middle
    power = float(np.vdot(moved, moved).real)
    factor = np.vdot(moved, wanted) / power if power > 0 else 0.0
    if not scaled:
        factor = factor / abs(factor) if factor else 1.0
    fitted = factor * moved + wanted.mean()
    return np.stack([fitted.real, fitted.imag], axis=1)


def way_along(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the path length from the first of positions (n, 2) to each of them, (n,)."""
    steps = np.hypot(*np.diff(positions, axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps)])


def shape_error(drawn: NDArray[np.float64], true: NDArray[np.float64]) -> float | None:
    extent = float(np.ptp(true, axis=0).max())
    if extent == 0.0 or len(drawn) < 2:
        return None
    return absolute_error(drawn, true) / extent


def absolute_error(
    points: NDArray[np.float64], true: NDArray[np.float64], *, scaled: bool = True,
) -> float:
    """
    Return the root mean square distance of points (n, 2) from the true ones after the best fit.

    That is the absolute trajectory error (ATE), in the unit of the true points. ``scaled`` is as
    in ``aligned``.
    """
    off = aligned(points, true, scaled=scaled) - true
    return _rms(np.hypot(off[:, 0], off[:, 1]))


def distance_error(found: NDArray[np.float64], true: NDArray[np.float64]) -> float | None:
    """
    Return the relative error of the path length of positions (n, 2), negative if too short.

    None if the true vehicle does not move.
    """
    there = way_along(true)[-1]
    return float(way_along(found)[-1] / there - 1.0) if there > 0.0 else None


def relative_errors(
    found: NDArray[np.float64], true: NDArray[np.float64],
) -> RelativeErrors | None:
    """
    Return the mean errors over all parts of 100, 200, ... 800 m that begin at every 10th frame.

    If the drive is shorter than 200 m, parts of 50 m are included. A part ends at the first frame
    at which the true path has its length. The errors are shares of the true length up to there
    (KITTI's own program divides by the nominal length, which differs by half a step on average).

    Parameters
    ----------
    found, true
        (n, 3) x, y and yaw at the same frames, each in its own frame; metres and radians.

    Returns
    -------
    RelativeErrors or None
        None if the drive is shorter than the shortest part.

    """
    way = way_along(true[:, :2])
    short = (_SHORT_M,) if way[-1] < _SHORT_DRIVE_M else ()
    starts, ends = np.concatenate(
        [_parts(way, length) for length in (*short, *_LENGTHS_M)], axis=1)
    if not len(starts):
        return None
    reached, turned = _moved(found, starts, ends)
    true_reached, true_turned = _moved(true, starts, ends)
    lengths = way[ends] - way[starts]
    # Modulo full turns.
    turn_error = np.abs(np.angle(np.exp(1j * (turned - true_turned))))
    return RelativeErrors(
        translation=float(np.mean(np.abs(reached - true_reached) / lengths)),
        rotation=float(np.mean(turn_error / lengths)))


def _partners(found: Sequence[Turn], there: Sequence[Turn]) -> dict[int, int]:
    """Return the true turn for each turn found, by indices: same side, within the tolerance."""
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
    """Return how long two turns overlap, negative for the time between them."""
    return min(turn.end_ns, other.end_ns) - max(turn.start_ns, other.start_ns)


def _per_100m(error: NDArray[np.float64], positions: NDArray[np.float64]) -> float | None:
    """Return the mean absolute growth of the error over stretches of 100 m."""
    way = way_along(positions)
    if way[-1] == 0.0:
        return None
    starts, ends = _parts(way, _STRETCH_M, every=1)
    if not len(starts):
        return abs(float(error[-1])) / float(way[-1]) * _STRETCH_M
    return float(np.abs(error[ends] - error[starts]).mean())


def _parts(way: NDArray[np.float64], length: float, *, every: int = _EVERY) -> NDArray[np.int64]:
    """Return the first and the last frames of all parts of a length, (2, m)."""
    starts = np.arange(0, len(way), every)
    ends = np.searchsorted(way, way[starts] + length)
    inside = ends < len(way)
    return np.stack([starts[inside], ends[inside]])


def _moved(
    poses: NDArray[np.float64], starts: NDArray[np.int64], ends: NDArray[np.int64],
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Return the end of each part, x + iy relative to its first pose, and its rotation."""
    place = poses[:, 0] + 1j * poses[:, 1]
    yaw = poses[:, 2]
    return (place[ends] - place[starts]) * np.exp(-1j * yaw[starts]), yaw[ends] - yaw[starts]


def _rms(values: NDArray[np.float64]) -> float:
    return math.sqrt(float(np.mean(np.square(values))))
