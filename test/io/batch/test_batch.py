# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Many sources: names of folders, processes that die, and the summary."""

import csv
import json
import multiprocessing
import os
from pathlib import Path

import cv2
from far_scene import turned_drive
from fragile import killed_always, killed_once, never_returns, VARIABLE
import numpy as np
from phase_traj_ros.core import Counters, LengthUnit, Travel, TravelState, Way
from phase_traj_ros.core.reliability import Reason, Reliability
from phase_traj_ros.io.batch.many import (
    failure,
    folder_names,
    Job,
    Outcome,
    remove_leftovers,
    run_job,
    Status,
)
from phase_traj_ros.io.batch.parallel import run_parallel
from phase_traj_ros.io.batch.summary import COLUMNS, write_summary
from phase_traj_ros.parameters import Parameters
from polyline import off
import pytest
from rolled import MOVEMENT, SHIFTS, write_rolled

FILES = {
    'chain_code.json', 'manifest.json', 'shifts.csv', 'trajectory.png', 'trajectory.tum',
    'turns.png'}


@pytest.fixture
def marks(tmp_path, monkeypatch):
    """Return a folder in which processes that are killed leave a file."""
    folder = tmp_path / 'marks'
    folder.mkdir()
    monkeypatch.setenv(VARIABLE, str(folder))
    return folder


@pytest.fixture
def root(tmp_path):
    folder = tmp_path / 'results'
    folder.mkdir()
    return folder


def jobs_for(root, sources):
    names = folder_names(sources)
    return [
        Job(source=source, root=root, folder=name, batch='batch-',
            parameters=Parameters(threshold=16.0))
        for source, name in zip(sources, names)]


def files_in(folder):
    return {path.name for path in folder.iterdir()}


def test_the_outcome_of_a_job(tmp_path, root):
    [job] = jobs_for(root, [write_rolled(tmp_path / 'drive')])
    seen = []
    outcome = run_job(job, lambda done, expected: seen.append((done, expected)))
    assert (outcome.status, outcome.frames, outcome.turns) == (Status.OK, len(SHIFTS) + 1, 2)
    assert outcome.route == ((0, 0), (3, 0), (3, 4), (7, 4))
    assert outcome.seconds > 0 and outcome.error == ''
    assert files_in(root / 'drive') == FILES
    assert seen == [(number, len(SHIFTS) + 1) for number in range(len(SHIFTS) + 1)]


def test_a_route_along_the_heading_has_few_points_too(tmp_path, root):
    camera, pictures = turned_drive()
    (tmp_path / 'drive').mkdir()
    for index, picture in enumerate(pictures):
        cv2.imwrite(str(tmp_path / 'drive' / f'{index:04}.png'), picture)
    routes = {}
    for path_from in ('codes', 'heading'):
        parameters = Parameters(
            threshold=16.0, focal_px=camera.fx, path_from=path_from, speed=5.0)
        job = Job(
            source=tmp_path / 'drive', root=root, folder=path_from, batch='batch-',
            parameters=parameters)
        routes[path_from] = np.array(run_job(job).route)
        drawn = np.loadtxt(job.output / 'trajectory.tum')[:, 1:3]
        assert off(drawn, routes[path_from]) < 0.02 * np.ptp(drawn, axis=0).max()
    # Four corners, each of them rounded.
    assert len(routes['codes']) == 6
    assert 6 < len(routes['heading']) <= 20


@pytest.mark.parametrize(('fault', 'error'), [
    ('missing', 'does not exist'), ('root', 'have to share it'), ('bug', 'KeyError')])
def test_every_error_is_reported_in_one_line(tmp_path, root, monkeypatch, fault, error):
    source = write_rolled(tmp_path / 'drive')
    if fault == 'missing':
        source = tmp_path / 'none'
    elif fault == 'root':
        root = tmp_path / 'elsewhere'
    else:
        def broken(*args, **kwargs):
            raise KeyError('a\nb')
        monkeypatch.setattr('phase_traj_ros.io.batch.many.replay_source', broken)
    [job] = jobs_for(root, [source])
    outcome = run_job(job)
    assert outcome.status is Status.FAILED and error in outcome.error
    assert '\n' not in outcome.error
    assert not job.output.exists()


@pytest.mark.parametrize(('sources', 'names'), [
    (['a/x.mcap', 'b/y.mp4'], ['x', 'y']),
    (['a/x.mcap', 'b/X.mp4'], ['a-x', 'b-X']),
    (['a/x.mcap', 'a/x.mp4', 'a/x.mcap'], ['a-x', 'a-x-2', 'a-x-3']),
    (['00/image_0', '06/image_0', 'image_0.mp4'], ['00-image_0', '06-image_0', '{here}-image_0']),
    (['summary.csv.mcap', 'x'], ['summary.csv-2', 'x']),
    (['.', 'a/..'], ['{here}-{here}', '{here}-{here}-2']),
    (['.hidden.mp4', 'new\nline.mp4'], ['hidden', 'new_line']),
    (['=1+1.mp4', '-x.mp4', '=.mp4'], ['1+1', 'x', 'source']),
    ([f'{"long" * 60}.mp4'], ['long' * 20]),
])
def test_every_source_has_a_folder_of_its_own(tmp_path, monkeypatch, sources, names):
    here = tmp_path / 'here'
    (here / 'a').mkdir(parents=True)
    monkeypatch.chdir(here)
    found = folder_names(map(Path, sources), taken=('summary.csv', 'summary.html'))
    if sources[0] == '.':
        names = [f'{tmp_path.name}-here', f'{tmp_path.name}-here-2']
    assert found == [name.format(here='here') for name in names]


def test_a_process_that_is_killed_loses_nothing(tmp_path, root, marks):
    sources = [write_rolled(tmp_path / name) for name in ('a', 'victim', 'b')]
    jobs = jobs_for(root, sources)
    progress = []
    outcomes = {
        outcome.folder: outcome for outcome in run_parallel(
            jobs, workers=2, run=killed_once, on_progress=progress.append)}
    assert len(list(marks.iterdir())) == 1
    assert {name: each.status for name, each in outcomes.items()} == {
        'a': Status.OK, 'victim': Status.OK, 'b': Status.OK}
    assert progress[-1] == 3 and progress == sorted(progress)
    remove_leftovers(jobs)
    for name in ('a', 'victim', 'b'):
        assert files_in(root / name) == FILES
        code = json.loads((root / name / 'chain_code.json').read_text())
        assert code['movement'] == MOVEMENT


def test_a_source_that_kills_its_process_each_time_is_reported(tmp_path, root, marks):
    sources = [write_rolled(tmp_path / name) for name in ('victim', 'a')]
    jobs = jobs_for(root, sources)
    outcomes = {
        outcome.folder: outcome for outcome in run_parallel(
            jobs, workers=1, run=killed_always)}
    assert len(list(marks.iterdir())) == 2
    assert outcomes['a'].status is Status.OK
    assert outcomes['victim'].status is Status.FAILED and 'died 2 times' in outcomes[
        'victim'].error
    remove_leftovers(jobs)
    assert files_in(root) == {'a'}


def test_errors_that_cannot_be_transferred_are_reported(tmp_path, root):
    jobs = jobs_for(root, [tmp_path / 'x', tmp_path / 'y'])
    outcomes = list(run_parallel(jobs, workers=1, run=never_returns))
    assert [outcome.error for outcome in outcomes] == ['RuntimeError: a fault of two lines'] * 2


def test_an_interruption_ends_its_processes_and_what_they_were_writing(tmp_path, root):
    # Long enough that it cannot end before its start is noticed.
    long = write_rolled(tmp_path / 'long', [0])
    for number in range(2, 6000):
        os.link(long / '0000.png', long / f'{number:04}.png')
    jobs = jobs_for(root, [write_rolled(tmp_path / 'short'), long])

    def interrupt(done):
        if done > 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        list(run_parallel(jobs, workers=1, on_progress=interrupt))
    assert multiprocessing.active_children() == []
    assert files_in(root) == {'short'} and files_in(root / 'short') == FILES


def test_the_summary(tmp_path):
    (tmp_path / 'x <b>').mkdir()
    (tmp_path / 'x <b>' / 'report.html').touch()
    job = Job(
        source=Path('bad,"\n.mp4'), root=tmp_path, folder='bad', batch='',
        parameters=Parameters())
    way = Way()
    way.add(Travel(2.5, 0.1, TravelState.MEASURED), 0.1)
    outcomes = [
        Outcome(
            source='x <b>.mp4', folder='x <b>', status=Status.OK, frames=9, turns=1, seconds=1.239,
            route=((0, 0), (4, 0), (4, 4)),
            reliability=Reliability((Reason.MANY_CUTS, Reason.CAMERA_NOT_KNOWN)), way=way,
            counters=Counters(dropped=3, skipped=2, repeated=1),
            length_unit=LengthUnit.CAMERA_HEIGHT),
        failure(job, 'it is\n<i>bad</i>', seconds=0.5),
        failure(job, 'not done', status=Status.INTERRUPTED),
    ]
    write_summary(outcomes, tmp_path)
    with (tmp_path / 'summary.csv').open(newline='') as file:
        rows = list(csv.reader(file))
    assert rows == [
        list(COLUMNS),
        ['x <b>.mp4', 'x <b>', 'ok', '9', '1', '1.24', '', 'false',
         'many_cuts camera_not_known', '2.5', 'camera heights',
         'measured:1 bridged:0 standing:0 given:0 unknown:0', '3', '2', '1'],
        ['bad,"\n.mp4', 'bad', 'failed', '0', '0', '0.50', 'it is <i>bad</i>', *[''] * 8],
        ['bad,"\n.mp4', 'bad', 'interrupted', '0', '0', '0.00', 'not done', *[''] * 8]]
    assert COLUMNS[:7] == ('source', 'folder', 'status', 'frames', 'turns', 'seconds', 'error')
    page = (tmp_path / 'summary.html').read_text()
    assert '<a href="x%20%3Cb%3E/report.html">x &lt;b&gt;</a>' in page
    assert '<span class="warn">false</span>' in page and 'many_cuts camera_not_known' in page
    assert '&lt;i&gt;bad&lt;/i&gt;' in page and '<i>' not in page and '{{' not in page
    assert '<polyline points="40.0,40.0 40.0,0.0 0.0,0.0"/>' in page
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        'manifest.json', 'summary.csv', 'summary.html', 'x <b>']


@pytest.mark.parametrize('source', ['=1+1.mp4', '@x', '-x.mp4', '+x', '\tx'])
def test_no_cell_of_the_summary_is_a_formula(tmp_path, source):
    outcome = Outcome(source=source, folder='x', status=Status.FAILED, error=f'{source} is bad')
    write_summary([outcome], tmp_path)
    with (tmp_path / 'summary.csv').open(newline='') as file:
        [row] = csv.DictReader(file)
    assert (row['source'], row['error']) == (f"'{source}", f"'{source} is bad")
    assert not any(cell.startswith(('=', '+', '-', '@', '\t')) for cell in row.values())


def test_the_guide_shows_the_table_as_it_is():
    guide = (Path(__file__).parents[3] / 'docs' / 'how-to' / 'many.md').read_text()
    assert f'\n    {",".join(COLUMNS)}\n' in guide
