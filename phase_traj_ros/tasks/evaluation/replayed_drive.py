# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Reads the results of a replay from its directory."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
import csv
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from phase_traj_ros.core.codes.codes import Direction, Movement
from phase_traj_ros.core.codes.freeman import AnyDirection, Freeman
from phase_traj_ros.core.heading.turns import Turn
from phase_traj_ros.core.path.trajectory import vertices
from phase_traj_ros.core.path.way import LengthUnit
from phase_traj_ros.core.status import PairStatus
from phase_traj_ros.errors import ResultError
from phase_traj_ros.io.sources.times_file import nanoseconds


@dataclass(frozen=True, slots=True, eq=False)
class ReplayedDrive:
    """
    The results of a replay, as far as they can be compared with the ground truth.

    stamps_ns
        (n,) stamps of the frames, nanoseconds.
    movement, direction
        The codes.
    status
        One per pair.
    directions
        Type of the directions, of which there are 4 or 8.
    heading
        (n,) radians, positive to the left, not wrapped; None if the replay did not measure it.
    turns
        The turns found; None if the replay did not measure the heading.
    poses
        (n, 3) x, y and yaw as in ``trajectory.tum``, in REP 103 axes, the yaw in radians and
        wrapped; None if that file is missing.
    unit
        Unit of x and y of the poses.
    frame_numbers
        (n,) numbers of the frames in the source, from 0 on; None if not known.
    source_frames
        Numbers of all frames of the source, as declared and as read, where known.
    """

    source: str
    stamps_ns: NDArray[np.int64]
    movement: tuple[Movement, ...]
    direction: tuple[AnyDirection, ...]
    status: tuple[PairStatus, ...]
    directions: type[Direction] | type[Freeman]
    heading: NDArray[np.float64] | None
    turns: tuple[Turn, ...] | None
    poses: NDArray[np.float64] | None
    unit: LengthUnit
    frame_numbers: NDArray[np.int64] | None = None
    source_frames: frozenset[int] = frozenset()

    @property
    def metric(self) -> bool:
        """Return whether there are poses, in metres."""
        return self.poses is not None and self.unit is LengthUnit.METRE

    @property
    def path(self) -> NDArray[np.float64] | None:
        """Return the positions of the poses, (n, 2)."""
        return None if self.poses is None else self.poses[:, :2]

    @property
    def _appended(self) -> NDArray[np.int64]:
        """Return how many directions there are up to each frame, (n,)."""
        steps = [movement is not Movement.NO_CHANGE for movement in self.movement]
        return np.cumsum([0, *steps])

    @property
    def direction_at(self) -> NDArray[np.int64]:
        """Return the direction at each frame, (n,)."""
        return np.array([self.directions.FORWARD, *self.direction])[self._appended]

    def drawn_from_codes(self) -> NDArray[np.float64]:
        """Return the path drawn from the codes, as the position at each frame, (n, 2)."""
        return np.asarray(vertices(self.direction, codes=self.directions)[self._appended])

    def drawn_from_heading(self) -> NDArray[np.float64] | None:
        """Return the path with a unit step along the measured heading, (n, 2), REP 103 axes."""
        if self.heading is None:
            return None
        length = np.array([status.judged for status in self.status], np.float64)
        middle = (self.heading[1:] + self.heading[:-1]) / 2
        steps = np.stack([length * np.cos(middle), length * np.sin(middle)], axis=1)
        return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


@contextmanager
def replay_files(directory: Path) -> Iterator[tuple[dict[str, Any], list[dict[str, Any]]]]:
    """
    Yield what chain_code.json holds and the rows of shifts.csv, to be understood in the block.

    Raises
    ------
    ResultError
        The directory does not contain a replay, or the block could not understand it.

    """
    try:
        content = json.loads((directory / 'chain_code.json').read_text(encoding='utf-8'))
        with (directory / 'shifts.csv').open(encoding='utf-8', newline='') as file:
            rows = list(csv.DictReader(file))
        yield content, rows
    except OSError as error:
        raise ResultError(
            f'{directory} does not hold a replay ({error.strerror}: {error.filename}): replay'
            ' the drive with it as the output folder') from None
    except (ArithmeticError, AttributeError, KeyError, RecursionError, TypeError, ValueError,
            csv.Error) as error:
        raise ResultError(
            f'{directory} does not hold what phase_traj replay writes ({type(error).__name__}:'
            f' {error}): replay again') from None


def read_replay(directory: Path) -> ReplayedDrive:
    """
    Read what ``phase_traj replay --output`` has written to a directory.

    Raises
    ------
    ResultError
        The directory does not contain a replay, or its files do not belong together.

    """
    with replay_files(directory) as (content, rows):
        heading, turns = content.get('heading_deg'), content.get('turns')
        numbers = content.get('frame_numbers')
        directions = Freeman if int(content.get('connectivity', 4)) == 8 else Direction
        stamps = [nanoseconds(row['stamp']) for row in rows]
        drive = ReplayedDrive(
            source=str(content['source']),
            stamps_ns=np.array([int(content['first_stamp_ns']), *stamps], np.int64),
            movement=tuple(Movement(code) for code in content['movement']),
            direction=tuple(directions(code) for code in content['direction']),
            status=tuple(map(PairStatus, content['status'])), directions=directions,
            heading=None if heading is None else np.radians(
                np.array(heading, np.float64).reshape(-1)),
            turns=None if turns is None else tuple(map(_turn, turns)),
            poses=_read_poses(directory),
            unit=LengthUnit(content['path_unit']),
            frame_numbers=None if numbers is None else np.array(numbers, np.int64).reshape(-1),
            source_frames=frozenset(
                int(count) for count in (content.get('source_frames') or {}).values()
                if count is not None))
    pairs = len(drive.stamps_ns) - 1
    appended = pairs - drive.movement.count(Movement.NO_CHANGE)
    if not (pairs >= 1 and pairs == len(drive.movement) == len(drive.status)
            and len(drive.direction) == appended
            and all(each is None or len(each) == pairs + 1
                    for each in (drive.heading, drive.poses, drive.frame_numbers))):
        raise ResultError(
            f'{directory}: chain_code.json, shifts.csv and trajectory.tum do not belong together:'
            ' replay again')
    return drive


def _read_poses(directory: Path) -> NDArray[np.float64] | None:
    file = directory / 'trajectory.tum'
    if not file.exists():
        return None
    rows = file.read_text(encoding='utf-8-sig').splitlines()
    if not any(row.split('#')[0].strip() for row in rows):
        raise ValueError(f'{file.name} is empty')
    x, y, qz, qw = np.loadtxt(rows, usecols=(1, 2, 6, 7), ndmin=2, unpack=True)
    return np.stack([x, y, 2 * np.arctan2(qz, qw)], axis=1)


def _turn(found: Mapping[str, Any]) -> Turn:
    return Turn(
        start_frame=int(found['start_frame']), end_frame=int(found['end_frame']),
        start_ns=round(float(found['start']) * 1e9), end_ns=round(float(found['end']) * 1e9),
        angle_deg=float(found['angle_deg']), peak_rate_deg_s=float(found['peak_rate_deg_s']))
