# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The jobs of a batch of sources, and their outcomes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum
from itertools import count
from pathlib import Path
import time

import cv2
import numpy as np
from phase_traj_ros.core import Counters, LengthUnit, Way
from phase_traj_ros.core.reliability import Reliability
from phase_traj_ros.errors import OutputError, PhaseTrajError
from phase_traj_ros.io.batch.job import Pass, replay_source, Wanted
from phase_traj_ros.io.outputs.outputs import remove_staging
from phase_traj_ros.io.replay.overview import turn_marks
from phase_traj_ros.io.replay.run import Replay
from phase_traj_ros.io.sources.base import DEFAULT_SPEED_TOPIC, Entry
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.io.sources.selection import EVERYTHING, Selection
from phase_traj_ros.parameters import Parameters

_LONGEST_NAME = 80
# Tolerance of a thinned route, as a share of its size: the summary draws it 40 pixels wide.
_ROUTE_DETAIL = 1 / 80


class Status(Enum):
    """Result of the replay of a source."""

    OK = 'ok'
    FAILED = 'failed'
    INTERRUPTED = 'interrupted'


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """A source to replay. It can be sent to another process or machine."""

    source: Path
    root: Path
    """Folder of the whole batch. It exists."""
    folder: str
    """Name of the folder of this source in ``root``."""
    batch: str
    """Name of the batch, unlike that of any other."""
    parameters: Parameters
    topic: str | None = None
    speed_topic: str = DEFAULT_SPEED_TOPIC
    selection: Selection = EVERYTHING
    fps: float | None = None
    one_pass: bool = False
    strict: bool = False
    svg: bool = False
    report: bool = False
    bag_name: str | None = None
    """Name of the result bag in the folder; None for no bag."""
    bag_debug_images: bool = False
    force: bool = False
    """Whether files of someone else in the folder are replaced."""
    inputs: tuple[Path, ...] = ()
    """All that the batch reads."""

    @property
    def output(self) -> Path:
        """Return the folder of this source."""
        return self.root / self.folder

    @property
    def wanted(self) -> Wanted:
        """Return the results to write."""
        bag = None if self.bag_name is None else self.output / self.bag_name
        return Wanted(
            output=self.output, svg=self.svg, report=self.report, bag_out=bag,
            bag_debug_images=self.bag_debug_images, force=self.force, inputs=self.inputs,
            batch=self.batch)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Outcome of a job."""

    source: str
    folder: str
    status: Status
    frames: int = 0
    turns: int = 0
    reliability: Reliability | None = None
    """Whether the result is reliable; None without a result."""
    seconds: float = 0.0
    """Duration of the work."""
    error: str = ''
    """Error message, in one line."""
    route: tuple[tuple[float, float], ...] = ()
    """The drawn path, thinned for a thumbnail, in its unit, REP 103 axes."""
    way: Way = field(default_factory=Way)
    """Distance travelled; it has no pairs if no distance is measured."""
    counters: Counters = field(default_factory=Counters)
    """Numbers of frames that were dropped, skipped or repeated."""
    length_unit: LengthUnit = LengthUnit.METRE
    """Unit of the distance."""


Progress = Callable[[int, 'int | None'], object]
"""Takes the number of frames done and expected; an exception stops the job."""


def run_job(job: Job, progress: Progress | None = None) -> Outcome:
    """Replay one source; return any error in the outcome."""
    began = time.monotonic()
    try:
        result = _replay(job, progress)
    except PhaseTrajError as error:
        return failure(job, str(error), seconds=time.monotonic() - began)
    # A broken source must not stop the others.
    except Exception as error:
        return failure(
            job, f'{type(error).__name__}: {error}', seconds=time.monotonic() - began)
    return Outcome(
        source=str(job.source), folder=job.folder, status=Status.OK, frames=result.frames,
        turns=len(turn_marks(result)), reliability=result.reliability,
        seconds=time.monotonic() - began, route=_route(result),
        way=result.way, counters=result.counters,
        length_unit=result.parameters.length_unit)


def failure(
    job: Job, error: str, *, seconds: float = 0.0, status: Status = Status.FAILED,
) -> Outcome:
    """Return the outcome of a job that failed or was not run."""
    return Outcome(
        source=str(job.source), folder=job.folder, status=status, seconds=seconds,
        error=' '.join(error.split()))


def folder_names(sources: Iterable[Path], *, taken: Sequence[str] = ()) -> list[str]:
    """
    Return a unique folder name for each source, unique also if case is ignored.

    It is the name of the source. Equal names are prefixed with the name of the parent folder,
    and numbered if they are still equal.
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
    """Remove the unfinished files of killed processes, once the jobs are over."""
    for job in jobs:
        remove_staging(job.output, job.batch)


def _named(source: Path) -> Path:
    """Return a path whose last part is a name, unlike '.' and '..'."""
    return source if source.name not in ('', '..') else source.resolve()


def _name_of(place: Path) -> str:
    return _clean(place.name if place.is_dir() else place.stem)


def _clean(name: str) -> str:
    kept = ''.join(sign if sign.isprintable() else '_' for sign in name).strip('. ').lstrip('=+-@')
    return kept[:_LONGEST_NAME] or 'source'


def _replay(job: Job, progress: Progress | None) -> Replay:
    # The process that starts the batch creates this folder. A worker must not: it would remove it
    # again if its source fails, or write to a folder of its own machine.
    if not job.root.is_dir():
        raise OutputError(
            f'the folder {job.root} does not exist: the machines of a cluster have to share it')
    with open_source(
            job.source, topic=job.topic, selection=job.selection, fps=job.fps) as source:
        passes = 2 if job.parameters.learns_camera and not job.one_pass else 1
        total = None if source.frame_count is None else passes * source.frame_count
        done = count()

        def counted(frames: Iterable[Entry], _: Pass) -> Iterator[Entry]:
            for frame in frames:
                if progress is not None:
                    progress(next(done), total)
                yield frame

        return replay_source(
            source, job.parameters, job.wanted, title=job.source.name or job.folder,
            through=counted, speed_topic=job.speed_topic, one_pass=job.one_pass,
            strict=job.strict)


def _route(result: Replay) -> tuple[tuple[float, float], ...]:
    """Return the drawn path, thinned to the points that a thumbnail needs."""
    path = np.array([(0, 0), *((each.tip.x, each.tip.y) for each in result.updates)], np.float32)
    finest = float(np.ptp(path, axis=0).max()) * _ROUTE_DETAIL
    points = cv2.approxPolyDP(path.reshape(-1, 1, 2), finest, closed=False)
    return tuple((float(x), float(y)) for x, y in points.reshape(-1, 2))
