# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Distance, speed and equal links in files, bag, prints, pictures and diagnostics."""

from dataclasses import replace
import json

import numpy as np
from phase_traj_ros.cli.main import main
from phase_traj_ros.core import (
    CodeSource,
    EstimatorSettings,
    LengthUnit,
    Lens,
    TrajectoryEstimator,
    Travel,
    TravelState,
    Way,
)
from phase_traj_ros.core.codes.text import parse_links
from phase_traj_ros.errors import ParameterError
from phase_traj_ros.io.messages.diagnostics import MeasurementReporter
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.results.bag import BagSink
from phase_traj_ros.io.results.files import CSV_COLUMNS, shift_row, Snapshot, write_results
from phase_traj_ros.io.results.pictures import draw
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
import pytest
from rolled import rolled_frames, SHIFTS, write_rolled
from rosbags import rosbag2, typesys

# 0.5 m a pair, 14 pairs: links of 2 m end with the pairs 3, 7 and 11.
GIVEN = {'focal_px': 300.0, 'speed': 5.0, 'code_step': 2.0, 'code_source': 'shift'}
LENGTH_M = 0.5 * len(SHIFTS)
STATES = {'measured': 0, 'bridged': 0, 'standing': 0, 'given': len(SHIFTS), 'unknown': 0}
NEW = ('distance', 'distance_variance', 'distance_state', 'speed', 'speed_variance')


@pytest.fixture(scope='module')
def result():
    return replay(rolled_frames(), Parameters(**GIVEN), source='a drive')


def followed(**values):
    """Return an estimator that has seen the frames, the last frame and what it has added."""
    estimator = TrajectoryEstimator(Parameters(**values).settings)
    for frame in rolled_frames():
        update = estimator.update(frame.image, frame.stamp_ns)
    return estimator, frame, update


def row_of(update):
    row = shift_row(update)
    assert row.keys() <= set(CSV_COLUMNS)
    return [row.get(name, '') for name in NEW]


def test_each_pair_has_its_row(result):
    for update in result.updates:
        distance, variance, state, speed, speed_variance = row_of(update)
        assert (float(distance), state, float(speed)) == (0.5, 'given', 5.0)
        assert float(variance) == pytest.approx(update.travel.variance, rel=1e-3)
        # Over 0.1 s, the variance of a speed is that of the distance a hundredfold.
        assert float(speed_variance) == pytest.approx(100 * float(variance), rel=2e-3)
    unknown = replace(
        result.updates[0], travel=Travel(1.0, 1.0, TravelState.UNKNOWN), speed=None,
        speed_variance=None)
    assert row_of(unknown) == ['', '', 'unknown', '', '']
    assert row_of(replace(unknown, travel=None)) == ['', '', '', '', '']


def test_the_whole_way_and_the_links_are_in_the_files(result, tmp_path):
    write_results(result, tmp_path)
    content = json.loads((tmp_path / 'chain_code.json').read_text())
    assert content['distance'] == pytest.approx(LENGTH_M)
    assert (content['distance_unit'], content['distance_states']) == ('m', STATES)
    assert content['links'] == [1, 1, 1]
    assert (content['code_step'], content['code_step_unit']) == (2.0, 'm')
    assert (content['links_runs'], content['links_totals']) == ([[1, 3]], [0, 3, 0, 0])
    assert [update.pair for update in result.updates if update.links] == [3, 7, 11]


def test_without_a_distance_there_is_nothing_of_it(tmp_path):
    found = replay(rolled_frames(), Parameters(code_source='shift'), source='')
    write_results(found, tmp_path)
    content = json.loads((tmp_path / 'chain_code.json').read_text())
    assert not {'distance', 'distance_unit', 'distance_states', 'links'} & set(content)
    assert {update.travel for update in found.updates} == {None}


def test_a_running_estimator_tells_it_too():
    estimator, *_ = followed(**GIVEN)
    values = MeasurementReporter().report(estimator, 0.0).values
    assert (values['distance (m)'], values['speed (m/s)']) == ('7.0', '5.00')
    assert [values[f'distance {name}'] for name in STATES] == ['0', '0', '0', '14', '0']
    content = Snapshot.of(estimator, Mounting(Parameters()), source='').content
    assert content['distance'] == pytest.approx(LENGTH_M)
    assert content['links_runs'] == [(1, 3)] and content['distance_states'] == STATES
    estimator.reset()
    assert (estimator.way.distance, estimator.way.pairs, len(estimator.links.series)) == (0, 0, 0)


def test_the_debug_image_has_a_line_for_it():
    estimator, frame, update = followed(**GIVEN)
    with_it = draw(frame, update, estimator)
    without = draw(frame, replace(update, travel=None), estimator)
    rows = np.flatnonzero(np.any(with_it != without, axis=(1, 2)))
    assert len(rows) and rows.max() < frame.image.shape[0] / 2


@pytest.mark.parametrize('values', [GIVEN, {'code_source': 'shift'}])
def test_speed_and_links_are_in_the_bag(tmp_path, values):
    parameters = Parameters(**values)
    with BagSink(tmp_path / 'out.mcap', Mounting(parameters), source='') as sink:
        result = replay(rolled_frames(), parameters, source='', watchers=[sink])
    store, found = typesys.get_typestore(typesys.Stores.ROS2_JAZZY), {}
    with rosbag2.Reader(tmp_path / 'out.mcap') as reader:
        for connection, _, data in reader.messages():
            message = store.deserialize_cdr(data, connection.msgtype)
            found.setdefault(connection.topic.removeprefix('/phase_traj/'), []).append(message)
    pair = {each.key: each.value for each in found['pair'][-1].status[0].values}
    if values is not GIVEN:
        assert not {'speed', 'odom', 'links'} & set(found)
        assert [pair[name] for name in NEW[:3]] == ['', '', '']
        return
    assert (float(pair['distance']), pair['distance_state']) == (pytest.approx(0.5), 'given')
    assert len(found['speed']) == len(found['odom']) == len(SHIFTS)
    for speed, odom in zip(found['speed'], found['odom']):
        assert (speed.header.frame_id, speed.header.stamp) == ('base_link', odom.header.stamp)
        assert speed.twist.twist.linear.x == pytest.approx(5.0)
        np.testing.assert_array_equal(speed.twist.covariance, odom.twist.covariance)
    # Of six dimensions x, y and yaw are those on the ground.
    covariance = np.reshape(found['odom'][-1].pose.covariance, (6, 6))
    np.testing.assert_array_equal(
        covariance[np.ix_((0, 1, 5), (0, 1, 5))], result.updates[-1].odometry.covariance)
    text = parse_links(found['links'][-1].data)
    assert (text.step, text.unit, text.links.runs) == (2.0, 'm', ((1, 3),))


def test_replay_prints_it_and_the_report_shows_it(tmp_path, capsys):
    source = write_rolled(tmp_path / 'drive')
    arguments = [item for name, value in GIVEN.items() for item in ('-p', f'{name}:={value}')]
    assert main([
        'replay', str(source), '--output', str(tmp_path / 'out'), '--report', *arguments]) == 0
    printed = capsys.readouterr().out
    assert 'distance: 7.0 m (pairs: 14 given)' in printed
    assert 'links of 2 m (3): 1x3' in printed
    page = (tmp_path / 'out' / 'report.html').read_text()
    assert '<dt>distance, m</dt><dd>7.0</dd>' in page and '<dt>links</dt><dd>3</dd>' in page
    assert 'distances given' in page and 'links of 2 m (3): 1×3' in page
    assert '"speed": [5.0' in page or '"speed":[5.0' in page


def test_a_way_counts_what_is_not_known_and_does_not_add_it():
    way = Way()
    for travel in (
            Travel(2.0, 0.1, TravelState.MEASURED), Travel(-1.0, 0.1, TravelState.GIVEN),
            Travel(1.0, 1.0, TravelState.UNKNOWN)):
        way.add(travel, 0.5)
    assert (way.distance, way.speed, way.pairs) == (3.0, None, 3)
    assert way.states[TravelState.UNKNOWN] == 1


@pytest.mark.parametrize('values', [{'focal_px': 300.0}, {}])
def test_links_take_a_camera(values):
    parameters = Parameters(code_step=2.0, code_source='shift', **values)
    settings = parameters.settings
    assert settings.measures_heading and settings.awaits_lens is not bool(values)
    assert settings.measures_distance and settings.length_unit is LengthUnit.CAMERA_HEIGHT


def test_the_length_of_links_is_settled_at_the_start():
    settings = EstimatorSettings(
        code_step=2.0, lens=Lens(focal_px=300.0), code_source=CodeSource.SHIFT)
    estimator = TrajectoryEstimator(settings)
    with pytest.raises(ValueError, match='the length of the links is fixed'):
        estimator.check(replace(settings, code_step=3.0))


def test_a_height_gives_metres():
    parameters = Parameters(camera_height=1.65, camera_height_deviation=0.1, code_step=5.0)
    settings = parameters.settings
    assert (settings.camera_height, settings.camera_height_deviation) == (1.65, 0.1)
    assert settings.metric and settings.length_unit is LengthUnit.METRE


@pytest.mark.parametrize('step', [0.01, -1.0])
def test_a_link_that_cannot_be_is_refused(step):
    with pytest.raises(ParameterError, match='code_step'):
        Parameters(code_step=step)
    with pytest.raises(ValueError, match='code_step'):
        EstimatorSettings(code_step=step)


def test_frames_of_another_size_do_not_end_the_links():
    frames = rolled_frames()
    frames[5] = StampedFrame(frames[5].image[:80], frames[5].stamp_ns)
    found = replay(frames, Parameters(**GIVEN), source='')
    assert len(found.links.series) == 3


@pytest.mark.parametrize('values', [{}, {'camera_height': 1.65}])
def test_what_is_not_known_adds_no_link(values):
    # The road begins too far away in so narrow a view.
    found = replay(rolled_frames(), Parameters(
        focal_px=600.0, code_step=0.5, code_source='shift', **values), source='')
    assert found.way.states[TravelState.UNKNOWN] == len(SHIFTS)
    assert (found.way.distance, len(found.links.series)) == (None, 0)
    unit = found.parameters.settings.path_unit(measured=found.way.measured)
    assert unit is LengthUnit.STEP
