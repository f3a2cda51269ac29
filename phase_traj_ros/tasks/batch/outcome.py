# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""One replay of a batch, and its outcome."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from itertools import count
import time

import numpy as np
from phase_traj_ros.core.reliability.verdict import Reliability
from phase_traj_ros.errors import message_of
from phase_traj_ros.io.replay.overview import outline, turn_marks
from phase_traj_ros.io.replay.run import Replay
from phase_traj_ros.io.sources.base import Entry
from phase_traj_ros.tasks.batch.job import replay_source, ReplayRequest

# Tolerance of a thinned route, as a share of its size: the summary draws it 40 pixels wide.
_ROUTE_DETAIL = 1 / 80


class Status(Enum):
    """Result of the replay of a source."""

    OK = 'ok'
    FAILED = 'failed'
    INTERRUPTED = 'interrupted'


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Outcome of a replay."""

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
    facts: Mapping[str, str] = field(default_factory=dict)
    """What else the summary tells of a result, by the names of its columns."""


Progress = Callable[[int, 'int | None'], object]
"""Takes the number of frames done and expected; an exception stops the replay."""


def run_request(request: ReplayRequest, progress: Progress) -> Outcome:
    """Replay one source; return any error in the outcome."""
    began = time.monotonic()
    try:
        result = _replay(request, progress)
    # A broken source must not stop the others.
    except Exception as error:
        return failure(request, message_of(error), seconds=time.monotonic() - began)
    return Outcome(
        source=str(request.source), folder=folder_of(request), status=Status.OK,
        frames=result.frames, turns=len(turn_marks(result)), reliability=result.reliability,
        seconds=time.monotonic() - began, route=_route(result), facts=dict(_facts(result)))


def failure(
    request: ReplayRequest, error: str, *, seconds: float = 0.0, status: Status = Status.FAILED,
) -> Outcome:
    """Return the outcome of a replay that failed or was not run."""
    return Outcome(
        source=str(request.source), folder=folder_of(request), status=status, seconds=seconds,
        error=' '.join(error.split()), facts={'warnings': '; '.join(request.parameters.notices)})


def folder_of(request: ReplayRequest) -> str:
    """Return the name of the output folder in that of the batch."""
    return '' if request.output is None else request.output.name


def _replay(request: ReplayRequest, progress: Progress) -> Replay:
    with request.opened() as source:
        done = count()

        def counted(frames: Iterable[Entry], which: str) -> Iterator[Entry]:
            # The passes have names if there are two.
            total = source.frame_count and source.frame_count * (2 if which else 1)
            for frame in frames:
                progress(next(done), total)
                yield frame

        return replay_source(source, request, through=counted)


def _facts(result: Replay) -> Iterator[tuple[str, str]]:
    """Yield the distance if it was measured, the frames that were not used, and the camera."""
    way, counters = result.way, result.counters
    if way.pairs:
        yield 'distance', '' if way.distance is None else str(way)
        yield 'distance_unit', result.parameters.settings.length_unit.value
        yield 'distance_states', ' '.join(
            f'{state.value}:{count}' for state, count in way.states.items())
    yield 'missing_frames', str(result.source_frames.missing)
    yield 'dropped_frames', str(counters.dropped)
    yield 'skipped_frames', str(counters.skipped)
    yield 'repeated_frames', str(counters.repeated)
    if result.camera is not None:
        yield 'camera', str(result.camera)
    if str(result.mounting):
        yield 'mount', str(result.mounting)
    hint = result.threshold_hint
    yield 'warnings', '; '.join(
        (*([] if hint is None else [hint.sentence]), *result.warnings))


def _route(result: Replay) -> tuple[tuple[float, float], ...]:
    """Return the drawn path, thinned to the points that a thumbnail needs."""
    path = np.array([(0, 0), *((each.tip.x, each.tip.y) for each in result.updates)])
    return tuple((x, y) for x, y in outline(path, _ROUTE_DETAIL).tolist())
