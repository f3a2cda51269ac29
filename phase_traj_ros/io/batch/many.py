# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Many sources, each replayed on its own: what there is to do, and how it went."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum
from itertools import count
from pathlib import Path
import shutil
import time

import cv2
import numpy as np
from phase_traj_ros.core import LengthUnit, Way
from phase_traj_ros.core.reliability import Reliability
from phase_traj_ros.errors import OutputError, PhaseTrajError
from phase_traj_ros.io.batch.job import replay_source, Wanted
from phase_traj_ros.io.replay.overview import turn_marks
from phase_traj_ros.io.replay.run import Replay
from phase_traj_ros.io.sources.base import DEFAULT_SPEED_TOPIC, StampedFrame
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.io.sources.selection import EVERYTHING, Selection
from phase_traj_ros.parameters import Parameters

_LONGEST_NAME = 80
# By how much a route may be off, as a share of its size: the summary draws it 40 pixels wide.
_ROUTE_DETAIL = 1 / 80


class Status(Enum):
    """How a source fared."""

    OK = 'ok'
    FAILED = 'failed'
    INTERRUPTED = 'interrupted'


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """One source to replay; it can be sent to another process or another machine."""

    source: Path
    root: Path
    """Folder of the whole batch, which exists."""
    folder: str
    """Name of this source's folder in it."""
    parameters: Parameters
    topic: str | None = None
    speed_topic: str = DEFAULT_SPEED_TOPIC
    selection: Selection = EVERYTHING
    fps: float | None = None
    one_pass: bool = False
    svg: bool = False
    report: bool = False
    bag_name: str | None = None
    """Name of the bag of results in the folder; None for no bag."""
    bag_debug_images: bool = False

    @property
    def output(self) -> Path:
        """Return the folder of this source."""
        return self.root / self.folder

    @property
    def wanted(self) -> Wanted:
        """Return which results are written."""
        bag = None if self.bag_name is None else self.output / self.bag_name
        return Wanted(
            output=self.output, svg=self.svg, report=self.report, bag_out=bag,
            bag_debug_images=self.bag_debug_images)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """How a job went."""

    source: str
    folder: str
    status: Status
    frames: int = 0
    turns: int = 0
    reliability: Reliability | None = None
    """Whether the result can be relied upon; None without one."""
    seconds: float = 0.0
    """That the work took."""
    error: str = ''
    """What went wrong, in one line."""
    route: tuple[tuple[float, float], ...] = ()
    """The drawn path, thinned for a small picture, in its unit, REP 103 axes."""
    way: Way = field(default_factory=Way)
    """How far it was; without any pairs where no distance is measured."""
    length_unit: LengthUnit = LengthUnit.METRE
    """What that is in."""


Progress = Callable[[int, 'int | None'], object]
"""Takes the number of frames done and of those to expect; an exception stops the job."""


def run_job(job: Job, progress: Progress | None = None) -> Outcome:
    """Replay one source; whatever goes wrong with it is told in the outcome."""
    began = time.monotonic()
    try:
        result = _replay(job, progress)
    except PhaseTrajError as error:
        return failure(job, str(error), seconds=time.monotonic() - began)
    # One source, however broken, must not stop the others.
    except Exception as error:
        return failure(
            job, f'{type(error).__name__}: {error}', seconds=time.monotonic() - began)
    return Outcome(
        source=str(job.source), folder=job.folder, status=Status.OK, frames=result.frames,
        turns=len(turn_marks(result)), reliability=result.reliability,
        seconds=time.monotonic() - began, route=_route(result),
        way=result.way,
        length_unit=result.parameters.length_unit)


def failure(
    job: Job, error: str, *, seconds: float = 0.0, status: Status = Status.FAILED,
) -> Outcome:
    """Return the outcome of a job that was not done."""
    return Outcome(
        source=str(job.source), folder=job.folder, status=status, seconds=seconds,
        error=' '.join(error.split()))


def folder_names(sources: Iterable[Path], *, taken: Sequence[str] = ()) -> list[str]:
    """
    Return a folder name for each source, unlike one another also where case does not count.

    It is the source's name, after that of its parent where several have the same, and numbered
    where that does not tell them apart.
    """
    places = [_named(source) for source in sources]
    often = Counter(_name_of(place).lower() for place in places)
    used = {name.lower() for name in taken}
    names = []
    for place in places:
        stem = _name_of(place)
        if often[stem.lower()] > 1:
            stem = f'{_clean(place.absolute().parent.name)}-{stem}'
        name, number = stem, 1
        while name.lower() in used:
            number += 1
            name = f'{stem}-{number}'
        used.add(name.lower())
        names.append(name)
    return names


def remove_leftovers(jobs: Iterable[Job]) -> None:
    """Remove what killed processes were about to write; the jobs must be over."""
    for job in jobs:
        for staging in job.output.glob('.phase_traj-*'):
            shutil.rmtree(staging, ignore_errors=True)
        if job.output.is_dir() and not any(job.output.iterdir()):
            job.output.rmdir()


def _named(source: Path) -> Path:
    """Return a path whose last part is a name: '.' and '..' are none."""
    return source if source.name not in ('', '..') else source.resolve()


def _name_of(place: Path) -> str:
    return _clean(place.name if place.is_dir() else place.stem)


def _clean(name: str) -> str:
    kept = ''.join(sign if sign.isprintable() else '_' for sign in name).strip('. ')
    return kept[:_LONGEST_NAME] or 'source'


def _replay(job: Job, progress: Progress | None) -> Replay:
    # Made by whoever starts the batch. A worker must not make it: it would take it away again
    # if its source fails, or write where nobody looks.
    if not job.root.is_dir():
        raise OutputError(
            f'the folder {job.root} is not there: a cluster has to share it between its machines')
    with open_source(
            job.source, topic=job.topic, selection=job.selection, fps=job.fps) as source:
        passes = 2 if job.parameters.learns_camera and not job.one_pass else 1
        total = None if source.frame_count is None else passes * source.frame_count
        done = count()

        def counted(frames: Iterable[StampedFrame]) -> Iterator[StampedFrame]:
            for frame in frames:
                if progress is not None:
                    progress(next(done), total)
                yield frame

        return replay_source(
            source, job.parameters, job.wanted, title=job.source.name or job.folder,
            through=counted, speed_topic=job.speed_topic, one_pass=job.one_pass)


def _route(result: Replay) -> tuple[tuple[float, float], ...]:
    """Return as few points of the drawn path as show it in a small picture."""
    path = np.array([(0, 0), *((each.tip.x, each.tip.y) for each in result.updates)], np.float32)
    finest = float(np.ptp(path, axis=0).max()) * _ROUTE_DETAIL
    points = cv2.approxPolyDP(path.reshape(-1, 1, 2), finest, closed=False)
    return tuple((float(x), float(y)) for x, y in points.reshape(-1, 2))
