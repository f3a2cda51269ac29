# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs jobs on a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import Any

from phase_traj_ros.errors import MissingDependencyError, ParameterError
from phase_traj_ros.io.batch.many import failure, Job, Outcome, run_job

_ANSWER_S = 30


def run_on_dask(
    jobs: Sequence[Job], address: str, *, run: Callable[[Job], Outcome] = run_job,
    on_progress: Callable[[float], object] = lambda done: None,
) -> Generator[Outcome, None, None]:
    """
    Yield the outcomes of all jobs in the order in which the workers of a cluster finish them.

    Each worker needs this package, and the sources and the folder of results under the same
    paths. If a worker dies, the scheduler gives its job to another one, as often as the setting
    ``distributed.scheduler.allowed-failures`` permits. After that, the job is reported as failed.

    Parameters
    ----------
    jobs
        The jobs to run.
    address
        Address of the scheduler, such as tcp://host:8786.
    run
        Runs a job; a function that the workers can import.
    on_progress
        Called with the number of finished jobs.

    Raises
    ------
    MissingDependencyError
        dask or distributed is not installed.
    ParameterError
        No scheduler answers at the address, or it has no workers.

    """
    try:
        from distributed import as_completed, Client
    except ImportError as error:
        raise MissingDependencyError(
            f'a dask cluster needs dask and distributed ({error}): install phase_traj_ros[dask]'
        ) from None
    try:
        client = Client(address, timeout=_ANSWER_S)
    except (OSError, ValueError) as error:
        raise ParameterError(
            f'dask at {address}: no scheduler answers there ({error}); start one with'
            ' dask-scheduler, or check the address') from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_ANSWER_S)
        except TimeoutError:
            raise ParameterError(
                f'dask at {address}: the scheduler has no workers; start some with dask-worker'
            ) from None
        # Not pure: a source that is requested again is replayed again.
        futures = {client.submit(run, job, pure=False): job for job in jobs}
        try:
            for number, future in enumerate(as_completed(futures)):
                on_progress(number + 1)
                yield _outcome(future, futures[future])
        finally:
            client.cancel(list(futures))


def _outcome(future: Any, job: Job) -> Outcome:
    error = future.exception()
    if error is not None:
        return failure(job, f'{type(error).__name__}: {error}')
    outcome: Outcome = future.result()
    return outcome
