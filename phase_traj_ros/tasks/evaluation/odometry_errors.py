# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Errors of odometry in metres: of the distance, and over parts of the drive.

All errors are in the plane. In three dimensions each slope would count as an error of a planar
path: a perfect one would be off by 1.4 to 2.5 %.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.tasks.evaluation.scores import way_along

_LENGTHS_M = (100, 200, 300, 400, 500, 600, 700, 800)
# For shorter drives, shorter parts are included.
_SHORT_DRIVE_M = 200.0
_SHORT_M = 50
# Number of frames between the starts of two parts.
_EVERY = 10


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


def _parts(way: NDArray[np.float64], length: float) -> NDArray[np.int64]:
    """Return the first and the last frames of all parts of a length, (2, m)."""
    starts = np.arange(0, len(way), _EVERY)
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
