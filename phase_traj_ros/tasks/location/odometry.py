# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads the odometry to locate: from a replay, its results, a trajectory, or equal links."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
import math
from pathlib import Path
import re
from typing import Any

import numpy as np
from phase_traj_ros.core import LengthUnit, OdometryStep, PairStatus, ScaleRange, TravelState
from phase_traj_ros.core.codes.links import MIN_STEP
from phase_traj_ros.core.codes.text import LinksText, parse_links
from phase_traj_ros.errors import reading, ResultError, SourceError
from phase_traj_ros.io.replay.run import Replay
from phase_traj_ros.io.sources.times_file import nanoseconds
from phase_traj_ros.tasks.evaluation.ground_truth import faces_its_way, read_ground_truth
from phase_traj_ros.tasks.evaluation.replayed_drive import replay_files
from phase_traj_ros.tasks.location.motion import Interruption, Motion, Motions, MovedPair

IN_METRES = ScaleRange(0.9, 1.1)
"""Scale of an odometry in metres, with a standard deviation of 5 %."""
IN_HEIGHTS = ScaleRange(1.1, 2.2)
"""Scale of an odometry in camera heights: the range of heights in cars, in metres."""

# A drive whose headings differ by less than this fits on any straight road. Radians.
_STRAIGHT = math.radians(30.0)
# A line that begins with a number, as a pose does.
_NUMBER = re.compile(rb'^[ \t]*[-+.]?[0-9]', re.MULTILINE)
# A line of equal links, bare or as ``ros2 topic echo`` prints it.
_MESSAGE = re.compile(r"""^[ \t]*(?:data:[ \t]*)?['"]?(step [^'"\r\n]*)""", re.MULTILINE)
_UNITS = (LengthUnit.METRE.value, LengthUnit.CAMERA_HEIGHT.value)
# Longer links do not tell streets apart, and poses that are farther apart do not show a way.
_LONGEST = 100.0
# Poses that are farther apart than a vehicle drives, in metres per second, are not one way: the
# second one has been corrected.
_FASTEST_CAR = 70.0
# More links would need too much memory.
_MOST = 200_000
# Poses this much farther apart than the fastest car drives are not one way. Metres.
_CLEARLY_APART = 3.0
_NO_DISTANCE = (
    'has no distances to be located by: replay it with code_source auto, and a camera that sees'
    ' the road')


@dataclass(frozen=True, slots=True)
class DriveOdometry:
    """
    The motion of a vehicle from pose to pose.

    source
        Name of the recording, for reports.
    stamps_ns
        Stamp of each pose, in nanoseconds.
    motions
        The motions from each pose to the next: one entry fewer than poses.
    scale
        Metres per unit of the distances.
    link
        Length of a link in units of the distances, if the drive is a bare code of equal links,
        whose stamps are their numbers; otherwise None.
    """

    source: str
    stamps_ns: tuple[int, ...]
    motions: tuple[tuple[Motion, ...], ...]
    scale: ScaleRange
    link: float | None = None

    @property
    def steps(self) -> list[OdometryStep]:
        """Return all steps, without the interruptions."""
        return [each for motions in self.motions for each in motions
                if isinstance(each, OdometryStep)]

    @property
    def straight(self) -> bool:
        """Return whether the drive has no turn, so that it fits on any straight road."""
        headings = np.cumsum([0.0, *(step.yaw for step in self.steps)])
        return bool(np.ptp(headings) < _STRAIGHT)


def odometry_of(result: Replay) -> DriveOdometry:
    """
    Return the odometry of a replay.

    Raises
    ------
    SourceError
        The replay has no distances.

    """
    pairs = [pair for update in result.updates if (pair := MovedPair.of(update)) is not None]
    if len(pairs) < len(result.updates) or not result.way.pairs:
        raise SourceError(f'{result.source} {_NO_DISTANCE}')
    return _joined(
        result.source, result.first_stamp_ns, pairs,
        result.parameters.settings.length_unit.value)


def read_odometry(path: Path) -> DriveOdometry:
    """
    Read the odometry from the results of a replay, or from a trajectory.

    Parameters
    ----------
    path
        The output folder of a replay, a file of lines ``stamp x y z qx qy qz qw`` (TUM), or a file
        with a line of ``~/links``.

    Raises
    ------
    ResultError
        The folder does not hold a replay with distances.
    SourceError
        The trajectory or the links cannot be read, see ``find_links``.

    """
    if path.is_dir():
        return _read_results(path)
    with reading(path):
        content = path.read_bytes()
    links = find_links(path, content)
    if links is not None:
        steps = steps_of_links(
            (code for code, count in links.links.runs for _ in range(count)),
            len(links.links.totals), links.step)
        return DriveOdometry(
            str(path), tuple(range(len(steps) + 1)), tuple((step,) for step in steps),
            _scale_in(links.unit), link=links.step)
    if not _NUMBER.search(content):
        what = 'holds neither poses nor' if content.strip() else 'is empty: give poses or'
        raise SourceError(
            f'{path} {what} a line of equal links; a pose is a line of stamp x y z qx qy qz qw')
    return _read_trajectory(path)


def find_links(path: Path, content: bytes) -> LinksText | None:
    """
    Return the last line of equal links in the content of a file; None if there is none.

    Raises
    ------
    SourceError
        The line is cut off or malformed, lacks links of the drive, has none or too many, or their
        unit or length is not supported.

    """
    lines = _MESSAGE.findall(content.decode('utf-8-sig', 'replace'))
    if not lines:
        return None
    line = lines[-1].rstrip()
    if line.endswith('...'):
        raise SourceError(
            f'{path}: the last line is cut off: record it with `ros2 topic echo --full-length`')
    try:
        text = parse_links(line)
    except ValueError as error:
        raise SourceError(f'{path}: {error}') from None
    series = text.links
    if not series.length:
        raise SourceError(f'{path} has no link: the drive is shorter than one')
    if not series.complete:
        raise SourceError(f'{path} does not have all links of a drive: older ones are left out')
    if text.unit not in _UNITS:
        raise SourceError(
            f'{path} has links in the unit {text.unit!r}: give links in {" or ".join(_UNITS)}')
    if not MIN_STEP <= text.step <= _LONGEST:
        raise SourceError(
            f'{path} has links of {text.step:g} {text.unit}: give links of {MIN_STEP:g} to'
            f' {_LONGEST:g}')
    if series.length > _MOST:
        raise SourceError(f'{path} has {series.length} links: give a drive of at most {_MOST}')
    return text


def steps_of_links(directions: Iterable[int], kinds: int, length: float) -> list[OdometryStep]:
    """
    Return the steps of a code of equal links; the stamps are their numbers, from 1.

    ``kinds`` is 4 for the directions of the paper and 8 for those of Freeman; ``length`` is that
    of a link.
    """
    steps, before = [], 0.0
    for number, each in enumerate(directions):
        # The paper counts clockwise from the left, Freeman counter-clockwise from the right.
        heading = (1 - each) * math.pi / 2 if kinds == 4 else (each - 2) * math.pi / 4
        steps.append(OdometryStep(
            stamp_ns=number + 1, distance=length, yaw=math.remainder(heading - before, math.tau)))
        before = heading
    return steps


def _read_results(directory: Path) -> DriveOdometry:
    with replay_files(directory) as (content, rows):
        cuts = frozenset(content.get('cuts', ()))
        unit = content.get('distance_unit')
        if unit is None:
            raise ResultError(f'{directory} {_NO_DISTANCE}')
        return _joined(
            str(content['source']), int(content['first_stamp_ns']),
            [_read_pair(row, cuts) for row in rows], unit)


def _read_pair(row: dict[str, Any], cuts: frozenset[int]) -> MovedPair:
    pair = MovedPair(
        stamp_ns=nanoseconds(row['stamp']), interval_ns=nanoseconds(row['interval']),
        status=PairStatus(row['status']), cut=int(row['pair']) in cuts)
    if pair.status is PairStatus.REPEATED:
        return pair
    # Results of earlier versions lack some columns.
    known = bool(row['distance']) and row.get('distance_state') != TravelState.BRIDGED.value
    return replace(
        pair, distance=float(row['distance']) if known else None,
        distance_variance=float(row['distance_variance']) if known else 0.0,
        yaw=math.radians(float(row['yaw_deg'])),
        yaw_variance=math.radians(1.0) ** 2 * float(row.get('yaw_variance') or 0.0))


def _joined(source: str, first_ns: int, pairs: list[MovedPair], unit: str) -> DriveOdometry:
    motions = Motions()
    return DriveOdometry(
        source, (first_ns, *(pair.stamp_ns for pair in pairs)),
        tuple(motions.of(pair) for pair in pairs), _scale_in(unit))


def _scale_in(unit: str) -> ScaleRange:
    return IN_METRES if unit == LengthUnit.METRE.value else IN_HEIGHTS


def _read_trajectory(path: Path) -> DriveOdometry:
    truth = read_ground_truth(path)
    if truth.stamps_ns is None:
        raise SourceError(
            f'{path} has no stamps: give a trajectory in the TUM format, lines of stamp x y z qx'
            ' qy qz qw')
    stamps = truth.stamps_ns.tolist()
    if not faces_its_way(truth, forward=True):
        raise SourceError(
            f'{path} has poses that do not face where they move: give the orientations of the'
            ' vehicle, with the x axis forward')
    poses = np.column_stack([truth.positions, truth.headings]).tolist()
    apart = np.hypot(*np.diff(truth.positions, axis=0).T).tolist()
    motions = tuple(
        (_motion(OdometryStep.between(*around, stamp_ns=stamp), way, (stamp - before) * 1e-9),)
        for *around, way, before, stamp in zip(poses, poses[1:], apart, stamps, stamps[1:]))
    return DriveOdometry(str(path), tuple(stamps), motions, IN_METRES)


def _motion(step: OdometryStep, apart: float, seconds: float) -> Motion:
    """Return the motion between two poses; an interruption if they do not show the way driven."""
    if apart <= min(_LONGEST, _FASTEST_CAR * seconds + _CLEARLY_APART):
        return step
    return Interruption.lasting(seconds, distance=apart, turn=abs(step.yaw))
