# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""``phase_traj replay A B C``: replays many recordings in parallel."""

from argparse import ArgumentParser, Namespace
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import replace
import os

from phase_traj_ros.cli.options import number
from phase_traj_ros.cli.report import BY_SOURCE, progress, warn
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.outputs.manifest import MANIFEST
from phase_traj_ros.io.outputs.outputs import check_directory
from phase_traj_ros.io.user_path import user_path
from phase_traj_ros.tasks.batch.engine import Batch
from phase_traj_ros.tasks.batch.executors import dask_executor, IsolatedProcesses
from phase_traj_ros.tasks.batch.job import batch_of, ReplayRequest
from phase_traj_ros.tasks.batch.outcome import Outcome, Status
from phase_traj_ros.tasks.batch.summary import CSV_NAME, HTML_NAME, SUMMARY_NAMES, write_summary

EXIT_SOME_FAILED = 1


def add_batch(parser: ArgumentParser) -> None:
    """Add the options for several sources."""
    parser.add_argument(
        '--jobs', metavar='N', type=number('1 or more', lambda jobs: jobs >= 1, int),
        help='replay N sources at a time (default: one per processor)')
    parser.add_argument(
        '--dask', metavar='ADDRESS',
        help='replay on the Dask cluster with this scheduler, such as tcp://host:8786; its'
             ' machines have to share the sources and DIR')


def replay_many(request: ReplayRequest, options: Namespace) -> int | None:
    """Replay all sources; return the exit status, None for success."""
    root, sources = request.output, options.sources
    if root is None:
        what = 'several sources need' if options.dask is None else '--dask needs'
        raise ParameterError(f'{what} --output DIR, with a folder for each source')
    if options.dask is not None:
        # The workers have other working directories.
        root, sources = root.absolute(), [source.absolute() for source in sources]
        parameters = request.parameters
        if parameters.mask_file:
            mask = user_path(parameters.mask_file).absolute()
            parameters = replace(parameters, mask_file=str(mask))
        request = replace(request, parameters=parameters)
    requests = batch_of(request, sources, root, taken=(*SUMMARY_NAMES, MANIFEST))
    check_directory(root, names=SUMMARY_NAMES, inputs=requests[0].inputs, force=request.force)
    batch = Batch(requests)
    with (_executor(options, len(requests)) as executor,
          progress(total=len(requests), title='sources', layout=BY_SOURCE) as bar):
        try:
            batch.run(executor, lambda done: bar.update(done - bar.n))
        except KeyboardInterrupt:
            # Complete results are kept, and the table lists the rest as interrupted.
            write_summary(batch.rows, root, force=request.force)
            raise
    write_summary(batch.rows, root, force=request.force)
    for row in batch.rows:
        print(_line(row))
        if row.facts.get('warnings'):
            warn(f'{row.source}: {row.facts["warnings"]}')
    print(f'written to {root}, see {HTML_NAME} or {CSV_NAME}')
    return None if all(row.status is Status.OK for row in batch.rows) else EXIT_SOME_FAILED


def _executor(options: Namespace, requests: int) -> AbstractContextManager[Executor]:
    workers = len(os.sched_getaffinity(0)) if options.jobs is None else options.jobs
    if options.dask is not None:
        return dask_executor(options.dask)
    return IsolatedProcesses(min(workers, requests))


def _line(outcome: Outcome) -> str:
    if outcome.status is not Status.OK:
        return f'{outcome.source}: {outcome.status.value}: {outcome.error}'
    line = (f'{outcome.source}: {outcome.frames} frames, {outcome.turns} turns,'
            f' {outcome.seconds:.1f} s')
    if outcome.reliability is None or outcome.reliability.reliable:
        return line
    return f'{line}, not reliable: {", ".join(outcome.reliability.words)}'
