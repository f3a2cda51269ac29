# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Scores of a replay against the ground truth."""

from argparse import Namespace
from dataclasses import replace
import json
from pathlib import Path

import numpy as np
from phase_traj_ros.cli.commands import evaluate as command
from phase_traj_ros.core.codes.from_heading import HeadingCode
from phase_traj_ros.core.heading.turns import find_turns
from phase_traj_ros.errors import ResultError
from phase_traj_ros.io.sources.opening import open_source
from phase_traj_ros.io.sources.selection import Selection
from phase_traj_ros.parameters import Parameters
from phase_traj_ros.tasks.batch.job import replay_source, ReplayRequest
from phase_traj_ros.tasks.evaluation import picture
from phase_traj_ros.tasks.evaluation.evaluate import evaluate
from phase_traj_ros.tasks.evaluation.ground_truth import GroundTruth
from phase_traj_ros.tasks.evaluation.replayed_drive import read_replay
from phase_traj_ros.tasks.evaluation.scores import aligned
import pytest
from rolled import write_rolled

PERIOD_NS = 100_000_000
STRAIGHT = [0.0] * 30


def bend(angle):
    return [angle / 30] * 30


DOCS = Path(__file__).resolve().parents[3] / 'docs'
PLAN = [*STRAIGHT, *bend(90), *STRAIGHT, *bend(-90), *STRAIGHT]


def headings(yaws):
    return np.radians(np.concatenate([[0.0], np.cumsum(yaws)]))


def truth_of(yaws, *, metres=1.0, stamps=None):
    heading = headings(yaws)
    steps = metres * np.stack([np.cos(heading), np.sin(heading)], axis=1)[:-1]
    positions = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    return GroundTruth(heading, positions, stamps)


@pytest.fixture
def replayed(tmp_path):
    """Return a function that writes the files of a replay with given yaws, degrees per pair."""
    def write(yaws, *, connectivity=4, **changed):
        heading = headings(yaws)
        codes, movement, direction = HeadingCode(connectivity=connectivity), [], []
        for angle, yaw in zip(heading[1:].tolist(), np.radians(yaws).tolist()):
            codes.update(angle, yaw / 0.1)
        movement = [int(code) for code in codes.movement]
        direction = [int(code) for code in codes.direction]
        stamps = [PERIOD_NS * index for index in range(len(heading))]
        content = {
            'source': 'made up', 'movement': movement, 'direction': direction,
            'status': ['ok'] * len(movement), 'first_stamp_ns': 0, 'connectivity': connectivity,
            'heading_deg': np.degrees(heading).tolist(), 'path_unit': 'step',
            'turns': [
                {'start_frame': turn.start_frame, 'end_frame': turn.end_frame,
                 'start': turn.start_ns / 1e9, 'end': turn.end_ns / 1e9,
                 'angle_deg': turn.angle_deg, 'peak_rate_deg_s': turn.peak_rate_deg_s,
                 'quarter_turns': turn.quarter_turns}
                for turn in find_turns(stamps, heading.tolist())],
            **changed}
        directory = tmp_path / 'results'
        directory.mkdir(exist_ok=True)
        (directory / 'chain_code.json').write_text(json.dumps(
            {key: value for key, value in content.items() if value is not None}))
        rows = [f'{pair},{stamp / 1e9:.9f}' for pair, stamp in enumerate(stamps[1:])]
        (directory / 'shifts.csv').write_text('\n'.join(['pair,stamp', *rows]) + '\n')
        return directory
    return write


def figures(replayed, measured, true=None, **options):
    drive = read_replay(replayed(measured, **options))
    return evaluate(drive, truth_of(measured if true is None else true))[0]


def test_a_perfect_replay(replayed):
    found = figures(replayed, PLAN)
    assert (found.turns.precision, found.turns.recall) == (1.0, 1.0)
    assert (found.turns.found, found.turns.true) == (2, 2)
    assert found.turns.angle_error_deg == pytest.approx(0.0, abs=1e-6)
    heading = found.heading_error_deg
    assert max(heading.rms, abs(heading.end), heading.max, heading.per_100m) < 1e-6
    assert found.direction.agreement == 1.0
    assert found.direction.changes == found.direction.true_changes == (0, 2)
    assert found.direction.same_changes
    assert found.shape_error.heading == pytest.approx(0.0, abs=0.01)
    assert found.shape_error.codes < 0.1
    assert found.length_m == pytest.approx(150.0)
    assert found.frames == 151


def test_heading_errors(replayed):
    # 0.01 degrees too much to the left in every pair of 1 m.
    found = figures(replayed, [yaw + 0.01 for yaw in PLAN], PLAN).heading_error_deg
    assert found.end == pytest.approx(1.5)
    assert found.max == pytest.approx(1.5)
    assert found.per_100m == pytest.approx(1.0)
    assert found.per_frame_rms == pytest.approx(0.01)
    assert found.rms == pytest.approx(1.5 / np.sqrt(3), rel=0.01)


def test_poses_without_orientations_are_refused(replayed):
    truth = truth_of(PLAN)
    with pytest.raises(ResultError, match='do not face where they move'):
        evaluate(read_replay(replayed(PLAN)), replace(truth, headings=0 * truth.headings))
    # A robot turns on the spot, a camera may look back, or a vehicle reverse.
    there_and_back = [*[0.0] * 10, *[6.0] * 30] * 6
    heading = headings(there_and_back)
    moves = (np.array(there_and_back) == 0.0)[:, None]
    steps = moves * np.stack([np.cos(heading), np.sin(heading)], axis=1)[:-1]
    places = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    robot = GroundTruth(heading, places, None)
    evaluate(read_replay(replayed(there_and_back)), robot)
    evaluate(read_replay(replayed(PLAN)), replace(truth, positions=-truth.positions))


def test_a_short_drive_is_scaled_to_100_m(replayed):
    found = figures(replayed, [0.02] * 50, [0.0] * 50).heading_error_deg
    assert found.end == pytest.approx(1.0)
    assert found.per_100m == pytest.approx(2.0)


@pytest.mark.parametrize(('measured', 'true', 'precision', 'recall'), [
    # Missed, invented, to the wrong side.
    ([*STRAIGHT, *STRAIGHT], [*STRAIGHT, *bend(90)], 1.0, 0.0),
    ([*STRAIGHT, *bend(90)], [*STRAIGHT, *STRAIGHT], 0.0, 1.0),
    ([*STRAIGHT, *bend(-90)], [*STRAIGHT, *bend(90)], 0.0, 0.0),
    # Turns of 55 to 65 degrees are not scored.
    ([*STRAIGHT, *bend(62)], [*STRAIGHT, *bend(58)], 1.0, 1.0),
    ([*STRAIGHT, *bend(62)], [*STRAIGHT, *STRAIGHT], 1.0, 1.0),
    ([*STRAIGHT, *bend(58)], [*STRAIGHT, *bend(63)], 1.0, 1.0),
    ([*STRAIGHT, *bend(58)], [*STRAIGHT, *bend(66)], 1.0, 0.0),
    ([*STRAIGHT, *bend(61)], [*STRAIGHT, *bend(70)], 1.0, 1.0),
    # A U-turn that was taken for two turns.
    ([*STRAIGHT, *bend(90), *[0.0] * 8, *bend(82)], [*STRAIGHT, *bend(90), *[1.0] * 8, *bend(82)],
     0.5, 1.0),
    # A delay of one second is tolerated, two are not.
    ([*STRAIGHT, *[0.0] * 39, *bend(90)], [*STRAIGHT, *bend(90), *[0.0] * 39], 1.0, 1.0),
    ([*STRAIGHT, *[0.0] * 50, *bend(90)], [*STRAIGHT, *bend(90), *[0.0] * 50], 0.0, 0.0),
    (STRAIGHT, STRAIGHT, 1.0, 1.0),
])
def test_turns(replayed, measured, true, precision, recall):
    found = figures(replayed, measured, true).turns
    assert (found.precision, found.recall) == (precision, recall)


def test_directions_that_differ(replayed):
    found = figures(replayed, [*STRAIGHT, *bend(40), *STRAIGHT], [*STRAIGHT, *bend(60), *STRAIGHT])
    assert found.direction.changes == () and found.direction.true_changes == (0,)
    assert not found.direction.same_changes
    assert 0.5 < found.direction.agreement < 0.7


def test_freemans_codes(replayed):
    found = figures(replayed, PLAN, connectivity=8)
    assert found.direction.agreement == 1.0
    assert found.direction.changes == (0, 0, 2, 2)


def test_a_replay_without_a_lens_has_codes_only(replayed):
    found = figures(replayed, PLAN, heading_deg=None, turns=None)
    assert found.turns is None and found.heading_error_deg is None
    assert found.shape_error.heading is None and found.shape_error.codes < 0.1
    assert found.direction.agreement == 1.0


def test_standing_still_draws_no_step(replayed):
    measured = [*STRAIGHT, *STRAIGHT, *bend(90), *STRAIGHT]
    directory = replayed(measured, status=['ok'] * 30 + ['still'] * 30 + ['ok'] * 60)
    drawn = read_replay(directory).drawn_from_heading()
    assert drawn[30].tolist() == drawn[60].tolist() == [30.0, 0.0]
    assert drawn[-1, 1] > 40


def test_figures_hold_from_where_the_truth_begins(replayed):
    drive = read_replay(replayed(PLAN))
    truth = truth_of(PLAN, stamps=np.arange(151) * PERIOD_NS)
    # During the first turn, which is then not scored.
    later = GroundTruth(truth.headings[40:], truth.positions[40:], truth.stamps_ns[40:])
    found, true = evaluate(drive, later)
    assert true.frames[0] == 40 and found.frames == 111
    assert found.heading_error_deg.max < 1e-6
    assert found.turns.precision == 1.0 and found.turns.true == 1


def with_path(directory, factor=1.05, turned=0.0):
    """Write the path of PLAN into a folder: so many metres per step, seen from another side."""
    truth = truth_of(PLAN)
    sine, cosine = np.sin(turned), np.cos(turned)
    places = factor * truth.positions @ np.array([[cosine, sine], [-sine, cosine]])
    write_tum(directory / 'trajectory.tum', places, truth.headings + turned)
    return directory


def write_tum(path, places, yaw):
    rest = np.zeros((len(places), 3))
    np.savetxt(path, np.column_stack([
        np.arange(len(places)) * 0.1, places, rest, np.sin(yaw / 2), np.cos(yaw / 2)]))


METRES = {'path_from': 'heading', 'path_unit': 'm'}


def test_a_path_in_camera_heights_has_the_shape_of_the_way(replayed):
    # True proportions: a shape without error, and no length in metres.
    drive = read_replay(with_path(
        replayed(PLAN, path_from='heading', path_unit='camera heights'), 1 / 1.65))
    found = evaluate(drive, truth_of(PLAN))[0]
    assert found.shape_error.path == pytest.approx(0.0, abs=1e-9)
    assert found.path_errors.ate_scaled_m == pytest.approx(0.0, abs=1e-6)
    assert found.path_errors.distance_error_percent is None


@pytest.mark.parametrize('selection', [
    Selection(every=2), Selection(start=0.5), Selection(start=0.3, duration=0.8, every=3)])
def test_poses_without_times_belong_to_the_frames_of_the_recording(tmp_path, selection):
    pytest.importorskip('matplotlib')
    folder = write_rolled(tmp_path / 'drive')
    with open_source(folder, selection=selection) as source:
        replay_source(
            source, ReplayRequest(
                source=folder, parameters=Parameters(threshold=16.0),
                output=tmp_path / 'results'))
    drive = read_replay(tmp_path / 'results')
    assert drive.frame_numbers.tolist() == [round(stamp / 1e8) for stamp in drive.stamps_ns]
    yaws = [float(number) for number in range(14)]
    found, true = evaluate(drive, truth_of(yaws))
    expected = headings(yaws)[drive.frame_numbers]
    np.testing.assert_allclose(true.headings, expected - expected[0])
    assert found.frames == len(drive.stamps_ns)
    with pytest.raises(ResultError, match='14 poses without times, and the recording 15 frames'):
        evaluate(drive, truth_of(yaws[1:]))


@pytest.mark.parametrize('turned', [0.0, 3.0])
def test_a_path_in_metres(replayed, turned):
    drive = read_replay(with_path(replayed(PLAN, **METRES), turned=turned))
    errors = evaluate(drive, truth_of(PLAN))[0].path_errors
    assert errors.distance_error_percent == pytest.approx(5.0)
    # Chords are shorter than the path.
    assert 4.0 < errors.t_rel_percent < 5.0
    assert errors.r_rel_deg_per_100m == pytest.approx(0.0, abs=1e-6)
    true = truth_of(PLAN).positions
    assert errors.ate_m == pytest.approx(
        0.05 * np.sqrt(true.var(axis=0).sum()))
    assert errors.ate_scaled_m == pytest.approx(0.0, abs=1e-6)


def test_a_path_without_metres_has_a_scaled_error_only(replayed):
    drive = read_replay(with_path(replayed(PLAN, path_unit='step'), 0.4))
    errors = evaluate(drive, truth_of(PLAN))[0].path_errors
    assert errors.ate_scaled_m == pytest.approx(0.0, abs=1e-6)
    assert (
        errors.distance_error_percent, errors.t_rel_percent, errors.r_rel_deg_per_100m,
        errors.ate_m) == (None,) * 4


def test_a_replay_without_a_path_has_no_errors_of_it(replayed):
    drive = read_replay(replayed(PLAN, **METRES))
    assert not drive.metric
    found = evaluate(drive, truth_of(PLAN))[0]
    assert found.path_errors.ate_scaled_m is None and found.shape_error.path is None


@pytest.mark.parametrize(('content', 'metric'), [
    ({'path_unit': 'm'}, True), ({'path_unit': 'step', 'path_from': 'heading'}, False),
    ({'path_unit': 'camera heights', 'path_from': 'heading'}, False),
    ({'path_unit': 'step', 'path_from': 'codes', 'speed': 5.0}, False)])
def test_which_paths_are_in_metres(replayed, content, metric):
    assert read_replay(with_path(replayed(PLAN, **content))).metric is metric


def test_errors_of_the_path_hold_from_where_the_truth_begins(replayed):
    truth = truth_of(PLAN, stamps=np.arange(151) * PERIOD_NS)
    later = GroundTruth(truth.headings[40:], truth.positions[40:], truth.stamps_ns[40:])
    errors = evaluate(read_replay(with_path(replayed(PLAN, **METRES), 1.0)), later)[0].path_errors
    assert max(abs(errors.distance_error_percent), errors.t_rel_percent, errors.ate_m) < 1e-6


@pytest.mark.parametrize('unit', ['m', 'step', 'camera heights'])
def test_a_path_in_metres_is_drawn_beside_the_truth(replayed, tmp_path, monkeypatch, unit):
    drawn = []
    monkeypatch.setattr(picture, 'save', lambda figure, path: drawn.append(figure))
    drive = read_replay(with_path(replayed(PLAN, path_unit=unit)))
    evaluation, true = evaluate(drive, truth_of(PLAN))
    picture.write_evaluation_picture(drive, true, evaluation, tmp_path / 'evaluation.png')
    plots = [plot for plot in drawn[0].axes if 'metres' in plot.get_title(loc='left')]
    assert len(plots) == (unit == 'm')
    in_heights = [plot for plot in drawn[0].axes if 'heights' in plot.get_title(loc='left')]
    assert len(in_heights) == (unit == 'camera heights')
    for plot in in_heights:
        assert 'off by 0.0%' in plot.get_title(loc='left')
        behind, path = (line.get_xydata() for line in plot.lines[:2])
        np.testing.assert_allclose(behind, path, atol=1e-6)
    for plot in plots:
        assert 'distance +5.0 %' in plot.get_title(loc='left')
        behind, path = (
            np.hypot(*np.diff(line.get_xydata(), axis=0).T).sum() for line in plot.lines[:2])
        assert (behind, path) == (pytest.approx(150.0), pytest.approx(157.5))


def test_the_command_scores_a_path_in_metres(replayed, tmp_path, capsys):
    directory = with_path(replayed(PLAN, **METRES))
    truth = truth_of(PLAN)
    write_tum(tmp_path / 'truth.tum', truth.positions, truth.headings)
    command.run(Namespace(
        directory=directory, ground_truth=tmp_path / 'truth.tum', align_start=False, force=False))
    printed = capsys.readouterr().out
    assert 'distance error: +5.0 %' in printed and 'in the plane' in printed
    written = json.loads((directory / 'evaluation.json').read_text())
    assert written['distance_error_percent'] == pytest.approx(5.0)
    assert 4.0 < written['t_rel_percent'] < 5.0
    assert written['r_rel_deg_per_100m'] == pytest.approx(0.0, abs=1e-6)
    assert written['ate_scaled_m'] < 1e-6 < 1.0 < written['ate_m']
    assert written['scored_in'] == 'plane'
    pages = [page.read_text() for page in DOCS.rglob('files.md')]
    table = pages[0].split('## `evaluation.json`')[1].split('\n## ')[0]
    assert {key for key in written if f'`{key}`' not in table} == set()


@pytest.mark.parametrize('scale', [0.1, 1.0, 7.0])
def test_alignment_undoes_what_it_may(scale):
    rng = np.random.default_rng(0)
    points = rng.normal(size=(40, 2)).cumsum(axis=0)
    turned = scale * points @ np.array([[0.6, 0.8], [-0.8, 0.6]]) + (30.0, -4.0)
    np.testing.assert_allclose(aligned(turned, points), points, atol=1e-9)
    mirrored = turned * (1, -1)
    assert np.abs(aligned(mirrored, points) - points).max() > 0.1
    assert np.isfinite(aligned(np.zeros((40, 2)), points)).all()


def test_the_command_writes_figures_and_a_picture(replayed, tmp_path, capsys):
    directory = replayed(PLAN)
    truth = truth_of(PLAN)
    half = truth.headings / 2
    rows = np.column_stack([
        np.arange(151) * 0.1, truth.positions, np.zeros((151, 3)), np.sin(half), np.cos(half)])
    path = tmp_path / 'truth.tum'
    np.savetxt(path, rows, fmt='%.9f')
    command.run(Namespace(directory=directory, ground_truth=path, align_start=False, force=False))
    printed = capsys.readouterr().out
    assert 'precision 1.000, recall 1.000' in printed and 'at 100.0% of the frames' in printed
    written = json.loads((directory / 'evaluation.json').read_text())
    assert written['turns']['precision'] == written['turns']['recall'] == 1.0
    assert set(written['heading_error_deg']) >= {'rms', 'end', 'max', 'per_100m'}
    assert set(written['shape_error']) == {'codes', 'heading', 'path'}
    assert (directory / 'evaluation.png').read_bytes().startswith(b'\x89PNG')
    assert {file.name for file in directory.iterdir()} == {
        'chain_code.json', 'shifts.csv', 'manifest.json', 'evaluation.json', 'evaluation.png'}


def test_the_command_does_without_heading(replayed, tmp_path, capsys):
    directory = replayed(PLAN, heading_deg=None, turns=None)
    truth = truth_of(PLAN)
    path = tmp_path / 'truth.tum'
    half = truth.headings / 2
    np.savetxt(path, np.column_stack([
        np.arange(151) * 0.1, truth.positions, np.zeros((151, 3)), np.sin(half), np.cos(half)]))
    command.run(Namespace(directory=directory, ground_truth=path, align_start=False, force=False))
    assert 'not measured' in capsys.readouterr().out
    written = json.loads((directory / 'evaluation.json').read_text())
    assert written['turns'] is None and written['heading_error_deg'] is None


def test_refuses_directories_without_a_replay(replayed, tmp_path):
    with pytest.raises(ResultError, match='does not hold a replay'):
        read_replay(tmp_path)
    for changed in ({'movement': [1, 1]}, {'direction': [9]}, {'status': None},
                    {'heading_deg': [0.0]}, {'heading_deg': 0.0}, {'turns': [{}]},
                    {'movement': 5}, {'path_unit': 'miles'}):
        with pytest.raises(ResultError, match='replay again'):
            read_replay(replayed(PLAN, **changed))
    for name, text in (('chain_code.json', '[]'), ('chain_code.json', '[' * 100_000),
                       ('trajectory.tum', '')):
        directory = replayed(PLAN)
        (directory / name).write_text(text)
        with pytest.raises(ResultError, match='replay again'):
            read_replay(directory)
