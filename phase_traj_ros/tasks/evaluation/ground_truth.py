# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Ground truth in KITTI or TUM format, as headings and positions on the ground.

Whatever the axes of the file, the result starts at the origin with heading 0, in REP 103 axes
(x forward, y left, yaw counter-clockwise) and metres.
"""

from collections.abc import Collection
from dataclasses import dataclass
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.errors import reading, ResultError, SourceError
from phase_traj_ros.io.messages.static_frames import rotation_matrices
from phase_traj_ros.io.sources.times_file import find_times, nanoseconds, read_times

_KITTI_COLUMNS, _TUM_COLUMNS = 12, 8
# Tolerance of the 3 x 3 part of a KITTI pose as a rotation, and of a quaternion's length.
_TOLERANCE = 0.02
_NANO = 1_000_000_000
# A frame may be this far outside the time of the ground truth.
_OUTSIDE_NS = 50_000_000
# Two poses between which the heading changes by more than this angle, in radians, may be so many
# usual intervals apart, but not less than the first and not more than the second of these seconds.
_TURN, _GAP, _GAP_S = math.radians(10.0), 5, (1.0, 5.0)
# Noise of positions hides the direction of the motion between closer poses. Metres.
_CLEARLY_APART = 3.0
# A vehicle moves aside where its motion is more than this angle off its axis, in
# radians. It rarely does: on at most this part of its way.
_ASIDE = math.radians(45.0)
_RARELY = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class GroundTruth:
    """
    A true trajectory relative to its first pose.

    headings
        (N,) radians, positive to the left, not wrapped, 0 at the first pose.
    positions
        (N, 2) metres, x forward and y left of the first pose.
    stamps_ns
        (N,) nanoseconds, or None if the file has no times: then pose i belongs to frame i of the
        source.
    """

    headings: NDArray[np.float64]
    positions: NDArray[np.float64]
    stamps_ns: NDArray[np.int64] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class MatchedTruth:
    """
    The ground truth at the frames of a replay, relative to the first of them.

    frames
        (M,) numbers of the frames that the ground truth covers, consecutive.
    stamps_ns, headings, positions
        At these frames: nanoseconds, radians, metres as in ``GroundTruth``.
    """

    frames: NDArray[np.int64]
    stamps_ns: NDArray[np.int64]
    headings: NDArray[np.float64]
    positions: NDArray[np.float64]


def read_ground_truth(path: Path) -> GroundTruth:
    """
    Read a file of KITTI poses or in the TUM format.

    - KITTI: lines of 12 numbers, the 3 x 4 matrix camera to world, of a camera with x to the
      right, y down and z forward. If there is a ``times.txt`` beside it, it gives the times of
      the poses; with 13 numbers, the first is the time.
    - TUM: lines ``stamp x y z qx qy qz qw``; comments begin with #. The motion decides which axis
      of the body points forward, x (ROS) or z (a camera's).

    The vertical is the axis of the world nearest to the vehicle's, so any axis may be up.

    Raises
    ------
    SourceError
        The file cannot be read, or has another format, or times.txt has another length.

    """
    stamps_ns, values = _read(path)
    rotations: NDArray[np.float64]
    if values.shape[1] == _TUM_COLUMNS - 1:
        rotations, places = _from_quaternions(path, values[:, 3:]), values[:, :3]
        optical = _moves_along_z(rotations, places)
    else:
        matrices = values.reshape(-1, 3, 4)
        if stamps_ns is None:
            stamps_ns = _times_beside(path, len(matrices))
        rotations, places = matrices[:, :, :3], matrices[:, :, 3]
        _check_rotations(path, rotations)
        optical = True
    x, y, z = np.moveaxis(rotations, 2, 0)
    forward, upward = (z, -y) if optical else (x, z)
    return _on_the_ground(forward, upward, places, stamps_ns)


def faces_its_way(truth: GroundTruth, *, forward: bool = False) -> bool:
    """
    Return whether a vehicle moves along its axis, but for a small part of its way.

    With ``forward``, it also has to drive ahead for most of it.
    """
    positions, headings = truth.positions, truth.headings
    chosen = [0]
    for index, position in enumerate(positions):
        if np.hypot(*(position - positions[chosen[-1]])) > _CLEARLY_APART:
            chosen.append(index)
    moved = np.diff(positions[chosen], axis=0)
    middle = (headings[chosen[1:]] + headings[chosen[:-1]]) / 2
    off, way = np.arctan2(*moved.T[::-1]) - middle, np.hypot(*moved.T)
    # Between poses on a curve, the motion is along neither of them.
    bends = np.abs(np.diff(headings[chosen])) > _ASIDE
    aside = (np.abs(np.cos(off)) < math.cos(_ASIDE)) & ~bends
    ahead = not forward or way @ np.cos(off) >= 0.0
    return bool(ahead and way @ aside <= _RARELY * way.sum())


def match(
    truth: GroundTruth, stamps_ns: NDArray[np.int64], *,
    numbers: NDArray[np.int64] | None = None, counts: Collection[int] = (),
    align_start: bool = False,
) -> MatchedTruth:
    """
    Return the ground truth at the frames of a replay.

    With times, the ground truth is interpolated. Without, pose i belongs to frame i of the source.

    Parameters
    ----------
    truth
        The whole ground truth.
    stamps_ns
        (n,) stamps of the frames of the replay, nanoseconds, which rise.
    numbers
        (n,) numbers of these frames in the source, from 0 on; None if the replay has all frames.
    counts
        Possible numbers of all frames of the source; empty if not known.
    align_start
        Whether the first pose belongs to the first frame, whatever their times.

    Raises
    ------
    ResultError
        Fewer than two frames are covered; poses are missing in a turn; there are no
        times, and the number of poses is not that of the frames; or the times do not overlap at
        all, without ``align_start``.

    """
    if truth.stamps_ns is None:
        frames = np.arange(len(stamps_ns))
        poses = _poses_of(len(truth.headings), len(stamps_ns), numbers, counts)
        headings, positions = truth.headings[poses], truth.positions[poses]
    else:
        given = truth.stamps_ns
        if align_start:
            given = given - given[0] + stamps_ns[0]
        frames = _covered(stamps_ns, given)
        # Differences first: a float cannot represent the nanoseconds of an epoch.
        at, times = (stamps_ns[frames] - given[0]) / _NANO, (given - given[0]) / _NANO
        _refuse_gaps(times, truth, at)
        headings, *axes = (
            np.interp(at, times, each) for each in (truth.headings, *truth.positions.T))
        positions = np.stack(axes, axis=1)
    sine, cosine = np.sin(headings[0]), np.cos(headings[0])
    turned = (positions - positions[0]) @ np.array([[cosine, -sine], [sine, cosine]])
    return MatchedTruth(frames, stamps_ns[frames], headings - headings[0], turned)


def _read(path: Path) -> tuple[NDArray[np.int64] | None, NDArray[np.float64]]:
    """Return the times of the poses in nanoseconds, where given, and the other columns."""
    with reading(path):
        lines = path.read_text(encoding='utf-8-sig').splitlines()
    rows = [line.split() for line in lines if line.strip() and not line.lstrip().startswith('#')]
    if len(rows) < 2:
        raise SourceError(f'{path} holds fewer than two poses: give KITTI poses or a TUM file')
    columns = len(rows[0])
    if columns not in (_TUM_COLUMNS, _KITTI_COLUMNS, _KITTI_COLUMNS + 1):
        raise SourceError(
            f'{path} has {columns} columns: KITTI poses have 12 (or 13 with a time first), a TUM'
            ' file 8')
    for number, row in enumerate(rows, 1):
        if len(row) != columns:
            raise SourceError(
                f'{path}, pose {number}: {len(row)} columns where the first one has {columns}')
    timed = columns != _KITTI_COLUMNS
    try:
        values = np.array([row[timed:] for row in rows], np.float64)
        times = np.array([nanoseconds(row[0]) for row in rows]) if timed else None
    except ValueError as error:
        raise SourceError(f'{path} holds something else than poses: {error}') from None
    if not np.isfinite(values).all():
        raise SourceError(f'{path} holds NaN or infinity')
    return None if times is None else _rising(path, times), values


def _rising(path: Path, stamps: NDArray[np.int64]) -> NDArray[np.int64]:
    if (np.diff(stamps) <= 0).any():
        raise SourceError(f'{path}: the times do not rise from pose to pose')
    return stamps


def _times_beside(path: Path, count: int) -> NDArray[np.int64] | None:
    times = find_times(path)
    if times is None:
        return None
    stamps = np.array(read_times(times), np.int64)
    if len(stamps) != count:
        raise SourceError(
            f'{times} has {len(stamps)} lines for the {count} poses of {path}: give the times of'
            ' these poses, or put the time in front of each')
    return _rising(times, stamps)


def _from_quaternions(path: Path, given: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation matrices (N, 3, 3) of quaternions (N, 4), x y z w."""
    lengths = np.linalg.norm(given, axis=1)
    if (np.abs(lengths - 1.0) > _TOLERANCE).any():
        raise SourceError(f'{path}: the last four columns are not quaternions of length 1')
    return rotation_matrices(given / lengths[:, None])


def _check_rotations(path: Path, rotations: NDArray[np.float64]) -> None:
    off = rotations @ rotations.transpose(0, 2, 1) - np.eye(3)
    if (np.abs(off) > _TOLERANCE).any() or (np.linalg.det(rotations) < 0).any():
        raise SourceError(f'{path} holds matrices that are not rotations: are these KITTI poses?')


def _moves_along_z(rotations: NDArray[np.float64], places: NDArray[np.float64]) -> bool:
    """Return whether the body moves along its z axis, as a camera does, rather than along x."""
    steps = np.diff(places, axis=0)
    along_x, _, along_z = np.abs(np.einsum('ni,nij->nj', steps, rotations[:-1]).sum(axis=0))
    return bool(along_z > along_x)


def _on_the_ground(
    forward: NDArray[np.float64], upward: NDArray[np.float64], places: NDArray[np.float64],
    stamps_ns: NDArray[np.int64] | None,
) -> GroundTruth:
    """Return the poses of a body with these axes and places in the world, (N, 3) each."""
    tilted = upward.mean(axis=0)
    vertical = np.abs(tilted).argmax()
    up = np.sign(tilted[vertical]) * np.eye(3)[vertical]
    ahead = forward[0] - (forward[0] @ up) * up
    ahead /= np.linalg.norm(ahead)
    left = np.cross(up, ahead)
    moved = places - places[0]
    return GroundTruth(
        headings=np.unwrap(np.arctan2(forward @ left, forward @ ahead)),
        positions=np.stack([moved @ ahead, moved @ left], axis=1), stamps_ns=stamps_ns)


def _covered(stamps_ns: NDArray[np.int64], given: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the numbers of the frames that the ground truth covers, by its stamps."""
    begin, end = given[0] - _OUTSIDE_NS, given[-1] + _OUTSIDE_NS
    if stamps_ns[-1] < begin or stamps_ns[0] > end:
        raise ResultError(
            f'the ground truth lasts from {_span(given)}, the replay from {_span(stamps_ns)}: if'
            ' both begin at the same moment and only their clocks differ, give align_start')
    frames = np.flatnonzero((stamps_ns >= begin) & (stamps_ns <= end))
    if len(frames) < 2:
        raise ResultError('the ground truth covers fewer than two frames: is it of this drive?')
    return frames


def _refuse_gaps(
    times: NDArray[np.float64], truth: GroundTruth, at: NDArray[np.float64],
) -> None:
    """Raise ResultError if poses at ``times`` are missing in a turn, between two frames."""
    steps, turns = np.diff(times), np.abs(np.diff(truth.headings)) > _TURN
    longest = np.clip(_GAP * np.median(steps), *_GAP_S)
    missing = np.flatnonzero(
        turns & (steps > longest) & (times[1:] > at[0]) & (times[:-1] < at[-1]))
    if len(missing):
        raise ResultError(
            f'the ground truth has no pose for {steps[missing[0]]:.1f} s, from'
            f' {times[missing[0]] - at[0]:.1f} s after the first frame on: replay the parts before'
            ' and after it, and evaluate each')


def _poses_of(
    poses: int, frames: int, numbers: NDArray[np.int64] | None, counts: Collection[int],
) -> NDArray[np.int64]:
    """Return the number of the pose of each frame, where pose i belongs to frame i."""
    if numbers is None:
        numbers, counts = np.arange(frames), {frames}
    if (poses not in counts) if counts else (poses <= numbers[-1]):
        known = ' or '.join(map(str, sorted(counts))) or f'at least {numbers[-1] + 1}'
        raise ResultError(
            f'the ground truth has {poses} poses without times, and the recording {known} frames:'
            ' give a file with times, or the poses of these frames')
    return numbers


def _span(stamps_ns: NDArray[np.int64]) -> str:
    return f'{stamps_ns[0] / _NANO:.3f} to {stamps_ns[-1] / _NANO:.3f} s'
