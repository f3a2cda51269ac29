# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Many sources: their requests, outcomes and summary."""

import csv
from dataclasses import replace
from pathlib import Path

import cv2
from far_scene import turned_drive
import numpy as np
from phase_traj_ros.core import Counters, Travel, TravelState, Way
from phase_traj_ros.core.reliability.reason import Reason
from phase_traj_ros.core.reliability.verdict import Reliability
from phase_traj_ros.errors import OutputError
from phase_traj_ros.io.sources.base import SourceFrames
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.tasks.batch.job import batch_of, folder_names, replay_source, ReplayRequest
from phase_traj_ros.tasks.batch.outcome import failure, Outcome, run_request, Status
from phase_traj_ros.tasks.batch.summary import COLUMNS, write_summary
from polyline import off
import pytest
from rolled import SHIFTS, write_rolled

FILES = {
    'chain_code.json', 'manifest.json', 'shifts.csv', 'trajectory.png', 'trajectory.tum'}


@pytest.fixture
def root(tmp_path):
    folder = tmp_path / 'results'
    folder.mkdir()
    return folder


def files_in(folder):
    return {path.name for path in folder.iterdir()}


def test_the_outcome_of_a_job(tmp_path, root):
    job = ReplayRequest(
        source=write_rolled(tmp_path / 'drive'), output=root / 'drive',
        parameters=Parameters(threshold=16.0))
    seen = []
    outcome = run_request(job, lambda done, expected: seen.append((done, expected)))
    assert (outcome.status, outcome.frames, outcome.turns) == (Status.OK, len(SHIFTS) + 1, 2)
    assert outcome.route == ((0, 0), (3, 0), (3, 4), (7, 4))
    assert outcome.seconds > 0 and outcome.error == ''
    assert files_in(root / 'drive') == FILES
    assert seen == [(number, len(SHIFTS) + 1) for number in range(len(SHIFTS) + 1)]


def test_what_the_summary_tells_of_a_result(tmp_path, monkeypatch):
    job = ReplayRequest(
        source=write_rolled(tmp_path / 'drive'), parameters=Parameters(threshold=16.0))
    with job.opened() as source:
        result = replay_source(source, job)
    way = Way()
    way.add(Travel(2.5, 0.1, TravelState.MEASURED), 0.1)
    result = replace(
        result, way=way, counters=Counters(dropped=3, skipped=2, repeated=1),
        source_frames=SourceFrames(declared=9, read=5))
    monkeypatch.setattr(
        'phase_traj_ros.tasks.batch.outcome.replay_source', lambda *_, **__: result)
    assert run_request(job, lambda *_: None).facts == {
        'distance': '2.5', 'distance_unit': 'camera heights',
        'distance_states': 'measured:1 bridged:0 standing:0 given:0 unknown:0',
        'missing_frames': '4', 'dropped_frames': '3', 'skipped_frames': '2',
        'repeated_frames': '1',
        'warnings': '9 frames are declared, but only 5 could be read: the recording is cut off or'
                    ' damaged, or a trimmed video; frames skipped: 2; the first: ; frames with the'
                    ' stamp or the image of the previous one: 1; frames dropped, as their stamps'
                    ' are out of order: 3'}


def test_a_route_along_the_heading_has_few_points_too(tmp_path, root):
    camera, pictures = turned_drive()
    (tmp_path / 'drive').mkdir()
    for index, picture in enumerate(pictures):
        cv2.imwrite(str(tmp_path / 'drive' / f'{index:04}.png'), picture)
    routes = {}
    for path_from in ('codes', 'heading'):
        parameters = Parameters(
            threshold=16.0, focal_px=camera.fx, path_from=path_from, speed=5.0)
        job = ReplayRequest(
            source=tmp_path / 'drive', output=root / path_from, parameters=parameters)
        routes[path_from] = np.array(run_request(job, lambda *_: None).route)
        drawn = np.loadtxt(job.output / 'trajectory.tum')[:, 1:3]
        assert off(drawn, routes[path_from]) < 0.02 * np.ptp(drawn, axis=0).max()
    # Four corners, each of them rounded.
    assert len(routes['codes']) == 6
    assert 6 < len(routes['heading']) <= 20


@pytest.mark.parametrize(('fault', 'error'), [
    ('missing', 'does not exist'), ('bug', 'KeyError')])
def test_every_error_is_reported_in_one_line(tmp_path, root, monkeypatch, fault, error):
    source = write_rolled(tmp_path / 'drive')
    if fault == 'missing':
        source = tmp_path / 'none'
    else:
        def broken(*args, **kwargs):
            raise KeyError('a\nb')
        monkeypatch.setattr('phase_traj_ros.tasks.batch.outcome.replay_source', broken)
    job = ReplayRequest(source=source, output=root / 'x')
    outcome = run_request(job, lambda *_: None)
    assert outcome.status is Status.FAILED and error in outcome.error
    assert '\n' not in outcome.error
    assert not job.output.exists()


def test_a_batch_gives_each_source_a_folder_and_reads_them_all(tmp_path):
    sources = [tmp_path / 'a.mp4', tmp_path / 'b.mp4']
    request = ReplayRequest(source=sources[0], bag_out=Path('codes.mcap'), one_pass=True)
    jobs = batch_of(request, sources, tmp_path / 'out')
    assert [job.source for job in jobs] == sources
    assert [job.output for job in jobs] == [tmp_path / 'out' / 'a', tmp_path / 'out' / 'b']
    assert [job.bag_out for job in jobs] == [job.output / 'codes.mcap' for job in jobs]
    assert all(job.one_pass and set(sources) <= set(job.inputs) for job in jobs)


def test_no_folder_of_a_batch_is_a_source(tmp_path):
    (tmp_path / 'out' / 'a').mkdir(parents=True)
    sources = [tmp_path / 'b.mp4', tmp_path / 'out' / 'a']
    with pytest.raises(OutputError, match='is an input'):
        batch_of(ReplayRequest(source=sources[0]), sources, tmp_path / 'out')


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


def test_the_summary(tmp_path):
    (tmp_path / 'x <b>').mkdir()
    (tmp_path / 'x <b>' / 'report.html').touch()
    job = ReplayRequest(source=Path('bad,"\n.mp4'), output=tmp_path / 'bad')
    outcomes = [
        Outcome(
            source='x <b>.mp4', folder='x <b>', status=Status.OK, frames=9, turns=1, seconds=1.239,
            route=((0, 0), (4, 0), (4, 4)),
            reliability=Reliability((Reason.MANY_CUTS, Reason.CAMERA_NOT_KNOWN)), facts={
                'distance': '2.5', 'distance_unit': 'camera heights', 'missing_frames': '4'}),
        failure(job, 'it is\n<i>bad</i>', seconds=0.5),
        failure(job, 'not done', status=Status.INTERRUPTED),
    ]
    write_summary(outcomes, tmp_path)
    with (tmp_path / 'summary.csv').open(newline='') as file:
        rows = list(csv.reader(file))
    assert rows == [
        list(COLUMNS),
        ['x <b>.mp4', 'x <b>', 'ok', '9', '1', '1.24', '', 'false',
         'many_cuts camera_not_known', '2.5', 'camera heights', '', '4', *[''] * 6],
        ['bad,"\n.mp4', 'bad', 'failed', '0', '0', '0.50', 'it is <i>bad</i>', *[''] * 12],
        ['bad,"\n.mp4', 'bad', 'interrupted', '0', '0', '0.00', 'not done', *[''] * 12]]
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
