# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The ground truth at the frames of a replay."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.errors import ResultError
from phase_traj_ros.tasks.evaluation.ground_truth import GroundTruth

_NANO = 1_000_000_000
# A frame may be this far outside the time of the ground truth, in seconds.
_OUTSIDE = 0.05


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
        Fewer than two frames are covered; there are no times, and the number of poses is not that
        of the frames; or the times do not overlap at all, without ``align_start``.

    """
    if truth.stamps_ns is None:
        at_frame = _poses_of(len(truth), len(stamps_ns), numbers, counts)
        return _rebased(
            np.arange(len(stamps_ns)), stamps_ns, truth.headings[at_frame],
            truth.positions[at_frame])
    given = truth.stamps_ns
    margin = round(_OUTSIDE * _NANO)
    if align_start:
        given = given - given[0] + stamps_ns[0]
    elif stamps_ns[-1] < given[0] - margin or stamps_ns[0] > given[-1] + margin:
        raise ResultError(
            f'the ground truth lasts from {_span(given)}, the replay from {_span(stamps_ns)}: if'
            ' both begin at the same moment and only their clocks differ, give align_start')
    frames = np.flatnonzero(
        (stamps_ns >= given[0] - margin) & (stamps_ns <= given[-1] + margin))
    if len(frames) < 2:
        raise ResultError('the ground truth covers fewer than two frames: is it of this drive?')
    # Differences first: a float cannot represent the nanoseconds of an epoch.
    at = (stamps_ns[frames] - given[0]) / _NANO
    times = (given - given[0]) / _NANO
    headings = np.interp(at, times, truth.headings)
    positions = np.stack(
        [np.interp(at, times, axis) for axis in truth.positions.T], axis=1)
    return _rebased(frames, stamps_ns[frames], headings, positions)


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


def _rebased(
    frames: NDArray[np.int64], stamps_ns: NDArray[np.int64], headings: NDArray[np.float64],
    positions: NDArray[np.float64],
) -> MatchedTruth:
    sine, cosine = np.sin(headings[0]), np.cos(headings[0])
    turned = (positions - positions[0]) @ np.array([[cosine, -sine], [sine, cosine]])
    return MatchedTruth(frames, stamps_ns, headings - headings[0], turned)
