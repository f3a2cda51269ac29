# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A real cluster of worker processes, one of which is killed during its work."""

import sys

from fragile import killed_always, killed_once, VARIABLE
from phase_traj_ros.errors import MissingDependencyError, ParameterError
from phase_traj_ros.io.batch import dask_cluster
from phase_traj_ros.io.batch.dask_cluster import run_on_dask
from phase_traj_ros.io.batch.many import folder_names, Job, remove_leftovers, Status
from phase_traj_ros.parameters import Parameters
import pytest
from rolled import SHIFTS, write_rolled

NAMES = ('a', 'victim', 'b', 'c')


@pytest.fixture
def marks(tmp_path, monkeypatch):
    """Return a folder in which processes that are killed leave a file."""
    folder = tmp_path / 'marks'
    folder.mkdir()
    monkeypatch.setenv(VARIABLE, str(folder))
    return folder


@pytest.fixture
def jobs(tmp_path):
    root = tmp_path / 'results'
    root.mkdir()
    sources = [write_rolled(tmp_path / name) for name in NAMES]
    return [
        Job(source=source, root=root, folder=name, batch='batch-',
            parameters=Parameters(threshold=16.0))
        for source, name in zip(sources, folder_names(sources))]


@pytest.fixture
def cluster(marks):
    """Return the address of a cluster of two processes, which inherit the folder of marks."""
    distributed = pytest.importorskip('distributed')
    with distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
            silence_logs=50) as found:
        yield found.scheduler_address


def test_a_worker_that_is_killed_loses_nothing(jobs, marks, cluster):
    progress = []
    outcomes = list(run_on_dask(jobs, cluster, run=killed_once, on_progress=progress.append))
    assert len(list(marks.iterdir())) == 1
    assert {outcome.folder: outcome.status for outcome in outcomes} == dict.fromkeys(
        NAMES, Status.OK)
    assert progress == [1, 2, 3, 4]
    remove_leftovers(jobs)
    for job in jobs:
        assert 'chain_code.json' in {path.name for path in job.output.iterdir()}
        assert not list(job.output.glob('.*'))
    assert {outcome.frames for outcome in outcomes} == {len(SHIFTS) + 1}


def test_a_source_that_kills_every_worker_is_reported(jobs, marks, cluster):
    outcomes = {
        outcome.folder: outcome for outcome in run_on_dask(jobs[:2], cluster, run=killed_always)}
    assert outcomes['victim'].status is Status.FAILED
    assert 'KilledWorker' in outcomes['victim'].error
    assert outcomes['a'].status is Status.OK


def test_no_scheduler(jobs, monkeypatch):
    pytest.importorskip('distributed')
    monkeypatch.setattr(dask_cluster, '_ANSWER_S', 1)
    with pytest.raises(ParameterError, match='no scheduler answers'):
        next(run_on_dask(jobs, 'tcp://127.0.0.1:9'))


def test_missing_dask_is_reported(jobs, monkeypatch):
    monkeypatch.setitem(sys.modules, 'distributed', None)
    with pytest.raises(MissingDependencyError, match=r'phase_traj_ros\[dask\]'):
        next(run_on_dask(jobs, 'tcp://127.0.0.1:9'))
