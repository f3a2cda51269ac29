# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The executor of a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager, suppress

from phase_traj_ros.errors import MissingDependencyError, ParameterError

_ANSWER_S = 30


@contextmanager
def dask_executor(address: str) -> Iterator[Executor]:
    """
    Yield an executor that runs calls on a Dask cluster.

    Each worker needs this package, and the sources and the folder of results under the same
    paths. If a worker dies, the scheduler gives its call to another one. If the scheduler ends,
    the futures are cancelled.

    Parameters
    ----------
    address
        Address of the scheduler, such as tcp://host:8786.

    Raises
    ------
    MissingDependencyError
        dask or distributed is not installed.
    ParameterError
        No scheduler answers at the address, or it has no workers.

    """
    try:
        from distributed import Client
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
    try:
        try:
            client.wait_for_workers(1, timeout=_ANSWER_S)
        except TimeoutError:
            raise ParameterError(
                f'dask at {address}: the scheduler has no workers; start some with dask-worker'
            ) from None
        # Not pure: a source that is requested again is replayed again.
        yield client.get_executor(pure=False)
    finally:
        # The scheduler may have ended.
        with suppress(Exception):
            client.close(timeout=_ANSWER_S)
