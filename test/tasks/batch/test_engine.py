# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""One engine for processes of this machine and for a cluster, with the same rules for both."""

import json
import multiprocessing
import os
import signal
import sys

from fragile import endless, killed_always, killed_once, never_returns, VARIABLE
from phase_traj_ros.errors import MissingDependencyError, ParameterError
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.tasks.batch import executors
from phase_traj_ros.tasks.batch.engine import Batch, Note, stop_jobs, Stopped
from phase_traj_ros.tasks.batch.executors import dask_executor, IsolatedProcesses
from phase_traj_ros.tasks.batch.job import batch_of, ReplayRequest
from phase_traj_ros.tasks.batch.outcome import Status
import pytest
from rolled import MOVEMENT, write_rolled

FILES = {
    'chain_code.json', 'manifest.json', 'shifts.csv', 'trajectory.png', 'trajectory.tum'}


@pytest.fixture(scope='module')
def marks_of_all(tmp_path_factory):
    folder = tmp_path_factory.mktemp('marks')
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, str(folder))
        yield folder


@pytest.fixture
def marks(marks_of_all):
    """Return a folder in which processes that are killed leave a file."""
    for mark in marks_of_all.iterdir():
        mark.unlink()
    return marks_of_all


@pytest.fixture(scope='module')
def local_cluster(marks_of_all):
    """Return a function that starts a cluster, whose workers inherit the folder of marks."""
    distributed = pytest.importorskip('distributed')
    with pytest.importorskip('dask').config.set(
            {'distributed.worker.multiprocessing-method': 'forkserver'}):
        # Workers are forks of a process that has imported what they need.
        distributed.utils.get_mp_context().set_forkserver_preload([
            'distributed', 'matplotlib.backends.backend_agg', 'matplotlib.figure',
            'phase_traj_ros.tasks.batch.outcome', 'pytest'])
        yield lambda workers: distributed.LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None,
            silence_logs=50)


@pytest.fixture(scope='module')
def scheduler(local_cluster):
    """Return the address of a scheduler of two workers."""
    with local_cluster(2) as found:
        yield found.scheduler_address


@pytest.fixture(scope='module')
def processes(marks_of_all):
    """Return an executor of two processes of this machine, which import the package once."""
    with IsolatedProcesses(2) as found:
        yield found


@pytest.fixture(params=['processes', 'dask'])
def executor(request, marks):
    """Return an executor of two processes, which inherit the folder of marks."""
    if request.param == 'processes':
        yield request.getfixturevalue('processes')
    else:
        with dask_executor(request.getfixturevalue('scheduler')) as found:
            yield found


def jobs_for(tmp_path, sources):
    request = ReplayRequest(source=sources[0], parameters=Parameters(threshold=16.0))
    return batch_of(request, sources, tmp_path / 'results')


def rows_of(batch):
    return {row.folder: row for row in batch.rows}


def files_in(folder):
    return {path.name for path in folder.iterdir()}


def test_a_process_that_is_killed_loses_nothing(tmp_path, executor, marks):
    names = ('a', 'victim', 'b')
    batch = Batch(
        jobs_for(tmp_path, [write_rolled(tmp_path / name) for name in names]), run=killed_once)
    progress = []
    batch.run(executor, progress.append)
    assert len(list(marks.iterdir())) == 1
    assert [row.status for row in batch.rows] == [Status.OK] * 3
    assert progress[-1] == 3 and progress == sorted(progress)
    assert files_in(tmp_path / 'results') == set(names)
    for name in names:
        assert files_in(tmp_path / 'results' / name) == FILES
        code = json.loads((tmp_path / 'results' / name / 'chain_code.json').read_text())
        assert code['movement'] == MOVEMENT


def test_a_source_that_kills_its_process_each_time_is_a_row(tmp_path, executor, marks):
    batch = Batch(jobs_for(
        tmp_path, [write_rolled(tmp_path / name) for name in ('victim', 'a')]), run=killed_always)
    batch.run(executor)
    assert len(list(marks.iterdir())) == 2
    rows = rows_of(batch)
    assert rows['a'].status is Status.OK
    assert rows['victim'].status is Status.FAILED
    assert 'its process has died 2 times' in rows['victim'].error
    assert files_in(tmp_path / 'results') == {'a'}


def test_errors_that_cannot_be_transferred_are_rows(tmp_path, executor):
    batch = Batch(jobs_for(tmp_path, [tmp_path / 'x', tmp_path / 'y']), run=never_returns)
    batch.run(executor)
    assert [row.error for row in batch.rows] == ['RuntimeError: a fault of two lines'] * 2


def test_an_interruption_keeps_what_is_complete_and_stops_the_rest(tmp_path, executor):
    batch = Batch(jobs_for(
        tmp_path, [write_rolled(tmp_path / name) for name in ('short', 'endless')]), run=endless)

    def interrupt(_):
        if batch.rows[0].status is Status.OK:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        batch.run(executor, interrupt)
    assert [row.status for row in batch.rows] == [Status.OK, Status.INTERRUPTED]
    assert files_in(tmp_path / 'results') == {'short'}
    assert files_in(tmp_path / 'results' / 'short') == FILES


def test_a_replay_that_completes_while_the_batch_ends_is_told_as_complete(tmp_path, executor):
    # The interrupt comes before any outcome was taken.
    batch = Batch(jobs_for(tmp_path, [write_rolled(tmp_path / 'a')]))
    take = batch._take
    folder = tmp_path / 'results' / 'a'

    def late(done):
        if done and not batch._stopping:
            raise KeyboardInterrupt
        take(done)

    batch._take = late
    with pytest.raises(KeyboardInterrupt):
        batch.run(executor)
    assert files_in(folder) == FILES and batch.rows[0].status is Status.OK


def test_no_job_goes_on_by_a_note_that_it_writes_while_the_batch_ends(tmp_path, monkeypatch):
    folder = tmp_path / 'notes'
    folder.mkdir()
    note, removed = Note(folder, 0), []
    note.begin()

    def remove(place, **_):
        removed.append(place)
        with pytest.raises(Stopped):
            note(1, 10)

    monkeypatch.setattr('shutil.rmtree', remove)
    stop_jobs(folder)
    assert removed


def test_machines_that_do_not_share_the_folder_are_told(tmp_path, executor):
    batch = Batch(jobs_for(tmp_path, [write_rolled(tmp_path / 'a')]), run=elsewhere)
    batch.run(executor)
    assert batch.rows[0].status is Status.FAILED and 'have to share it' in batch.rows[0].error


def elsewhere(request, progress):
    """Find no notes, as on a machine that does not share the folder."""
    raise Stopped


def test_a_scheduler_that_ends_leaves_rows(tmp_path, local_cluster, monkeypatch):
    monkeypatch.setattr(executors, '_ANSWER_S', 3)
    batch = Batch(jobs_for(
        tmp_path, [write_rolled(tmp_path / name) for name in ('short', 'endless')]), run=endless)
    found = local_cluster(1)

    def end(_):
        if batch.rows[0].status is Status.OK and found.status.name == 'running':
            found.close()

    with dask_executor(found.scheduler_address) as executor:
        batch.run(executor, end)
    rows = rows_of(batch)
    assert rows['short'].status is Status.OK
    assert rows['endless'].status is Status.FAILED and 'lost' in rows['endless'].error


def test_processes_ignore_the_signals_of_a_terminal():
    before = set(multiprocessing.active_children())
    with IsolatedProcesses(1) as executor:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            pid = executor.submit(os.getpid).result()
            os.kill(pid, number)
            assert executor.submit(os.getpid).result() == pid
    assert set(multiprocessing.active_children()) <= before


def blocked():
    """Return the signals that the main thread of this process blocks."""
    return set(map(int, signal.pthread_sigmask(signal.SIG_BLOCK, ())))


def test_processes_block_the_signals_from_their_first_moment(processes):
    # A handler would be set only after the imports, which a signal would end in a traceback.
    assert {signal.SIGINT, signal.SIGTERM, signal.SIGHUP} <= processes.submit(blocked).result()
    assert not {signal.SIGINT, signal.SIGTERM, signal.SIGHUP} & blocked()


def test_notes_tell_of_progress_attempts_and_the_end(tmp_path):
    folder = tmp_path / 'notes'
    folder.mkdir()
    first, second = Note(folder, 0), Note(folder, 1)
    assert [first.begin(), first.begin(), second.begin()] == [0, 1, 0]
    assert first.fraction() == 0
    first(2, 8)
    assert first.fraction() == 0.25
    Note(folder, 0)(8, 8)
    assert first.fraction() == 0.99
    second(3, None)
    assert second.fraction() == 0
    stop_jobs(folder)
    with pytest.raises(Stopped):
        Note(folder, 0)(3, 8)
    with pytest.raises(Stopped):
        first.begin()


def test_no_scheduler(monkeypatch):
    pytest.importorskip('distributed')
    monkeypatch.setattr(executors, '_ANSWER_S', 1)
    with (pytest.raises(ParameterError, match='no scheduler answers'),
          dask_executor('tcp://127.0.0.1:9')):
        pass


def test_missing_dask_is_reported(monkeypatch):
    monkeypatch.setitem(sys.modules, 'distributed', None)
    with (pytest.raises(MissingDependencyError, match=r'phase_traj_ros\[dask\]'),
          dask_executor('tcp://127.0.0.1:9')):
        pass
