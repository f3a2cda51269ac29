# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj replay A B C``: replays many recordings in parallel."""

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Generator, Mapping
from contextlib import closing, suppress
import os
from pathlib import Path
from uuid import uuid4

from phase_traj_ros.cli.options import inputs_of, parameters_of, print_notices, selection_of
from phase_traj_ros.cli.progress import gauge
from phase_traj_ros.errors import OutputError, ParameterError, PhaseTrajError
from phase_traj_ros.io.batch.dask_cluster import run_on_dask
from phase_traj_ros.io.batch.many import (
    failure,
    folder_names,
    Job,
    Outcome,
    remove_leftovers,
    Status,
)
from phase_traj_ros.io.batch.parallel import run_parallel
from phase_traj_ros.io.batch.summary import (
    CSV_NAME,
    HTML_NAME,
    SUMMARY_NAMES,
    write_summary,
)
from phase_traj_ros.io.outputs.manifest import MANIFEST
from phase_traj_ros.io.outputs.outputs import check_directory
from phase_traj_ros.io.results.figures import require_matplotlib

EXIT_SOME_FAILED = 1


def add_batch(parser: ArgumentParser) -> None:
    """Add the options for several sources."""
    parser.add_argument(
        '--jobs', metavar='N', type=int,
        help='replay N sources at a time (default: one per processor)')
    parser.add_argument(
        '--dask', metavar='ADDRESS',
        help='replay on the Dask cluster with this scheduler, such as tcp://host:8786; its'
             ' machines have to share the sources and DIR')


def replay_many(options: Namespace) -> int | None:
    """Replay all sources; return the exit status, None for success."""
    jobs = _jobs(options)
    workers = len(os.sched_getaffinity(0)) if options.jobs is None else options.jobs
    if workers < 1:
        raise ParameterError(f'--jobs is {workers}: give 1 or more')
    made = _make(options.output)
    outcomes: dict[str, Outcome] = {}
    try:
        with (gauge(total=len(jobs), title='sources') as on_progress,
              closing(_run(jobs, options.dask, workers, on_progress)) as done):
            for outcome in done:
                outcomes[outcome.folder] = outcome
    except KeyboardInterrupt:
        # Finished results are kept, and the table lists the rest as interrupted.
        _summarise(jobs, outcomes)
        raise
    except PhaseTrajError:
        if made:
            # Another program may have written into it meanwhile.
            with suppress(OSError):
                options.output.rmdir()
        raise
    rows = _summarise(jobs, outcomes)
    for row in rows:
        print(_line(row))
    print(f'written to {options.output}, see {HTML_NAME} or {CSV_NAME}')
    return None if all(row.status is Status.OK for row in rows) else EXIT_SOME_FAILED


def _summarise(jobs: list[Job], outcomes: Mapping[str, Outcome]) -> list[Outcome]:
    remove_leftovers(jobs)
    rows = [
        outcomes.get(job.folder) or failure(job, 'not done', status=Status.INTERRUPTED)
        for job in jobs]
    write_summary(rows, jobs[0].root, force=jobs[0].force)
    return rows


def _jobs(options: Namespace) -> list[Job]:
    """Return one job per source."""
    if options.output is None:
        raise ParameterError('several sources need --output DIR, for a folder each')
    for name in ('live', 'animation'):
        if getattr(options, name):
            raise ParameterError(f'--{name} works with one source only, and not with --dask')
    bag: Path | None = options.bag_out
    if bag is not None and bag.name != str(bag):
        raise ParameterError(
            f'--bag-out is {bag}: with several sources, give a name without a folder;'
            ' each source writes it to its own folder')
    require_matplotlib()
    parameters, selection = parameters_of(options), selection_of(options)
    print_notices(parameters)
    root: Path = options.output
    sources: list[Path] = options.sources
    if options.dask is not None:
        # The workers have other working directories.
        root, sources = root.absolute(), [source.absolute() for source in sources]
    batch = f'{uuid4().hex}-'
    jobs = [
        Job(source=source, root=root, folder=folder, parameters=parameters, topic=options.topic,
            speed_topic=options.speed_topic, selection=selection, fps=options.fps,
            one_pass=options.one_pass, strict=options.strict, svg=options.svg,
            report=options.report, bag_name=None if bag is None else bag.name,
            bag_debug_images=options.bag_debug_images, force=options.force,
            inputs=inputs_of(options, parameters), batch=batch)
        for source, folder in zip(
            sources, folder_names(sources, taken=(*SUMMARY_NAMES, MANIFEST)))]
    # Contradicting choices, and files of others, are reported before the work.
    check_directory(root, names=SUMMARY_NAMES, inputs=jobs[0].inputs, force=options.force)
    for job in jobs:
        check_directory(
            job.output, names=job.wanted.names, inputs=job.inputs, force=options.force)
    return jobs


def _make(directory: Path) -> bool:
    """Create a folder; return whether it did not exist."""
    there = directory.exists()
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f'cannot write to {directory}: {error.strerror}: choose another --output') from None
    return not there


def _run(
    jobs: list[Job], cluster: str | None, workers: int, on_progress: Callable[[float], object],
) -> Generator[Outcome, None, None]:
    if cluster is not None:
        return run_on_dask(jobs, cluster, on_progress=on_progress)
    return run_parallel(jobs, workers=workers, on_progress=on_progress)


def _line(outcome: Outcome) -> str:
    if outcome.status is not Status.OK:
        return f'{outcome.source}: {outcome.status.value}: {outcome.error}'
    line = (f'{outcome.source}: {outcome.frames} frames, {outcome.turns} turns,'
            f' {outcome.seconds:.1f} s')
    if outcome.reliability is None or outcome.reliability.reliable:
        return line
    return f'{line}, not reliable: {", ".join(outcome.reliability.words)}'
