# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags of results, read back with the packages mcap and mcap-ros2-support."""

from collections import defaultdict
import errno
import json
import math
from pathlib import Path
import re
import sys

from mcap import reader as mcap_reader
from mcap_ros2 import decoder as mcap_ros2
import numpy as np
from phase_traj_ros.core.codes.text import parse_chain_code
from phase_traj_ros.errors import MissingDependencyError, OutputError, SourceError
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.results.bag import BagSink
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
import pytest
from rolled import DIRECTION, MOVEMENT, RATE_NS, rolled_frames, SHIFTS, START_NS

TYPES = {
    '/phase_traj/movement': 'std_msgs/msg/UInt8',
    '/phase_traj/direction': 'std_msgs/msg/UInt8',
    '/phase_traj/shift': 'geometry_msgs/msg/Vector3Stamped',
    '/phase_traj/response': 'std_msgs/msg/Float32',
    '/phase_traj/status': 'std_msgs/msg/String',
    '/phase_traj/pose': 'geometry_msgs/msg/PoseStamped',
    '/phase_traj/pair': 'diagnostic_msgs/msg/DiagnosticArray',
    '/phase_traj/chain_code': 'std_msgs/msg/String',
    '/phase_traj/path': 'nav_msgs/msg/Path',
    '/diagnostics': 'diagnostic_msgs/msg/DiagnosticArray',
}
DEBUG = {'/phase_traj/debug_image': 'sensor_msgs/msg/Image'}
LAYOUT = Path(__file__).resolve().parents[3] / 'config' / 'foxglove_layout.json'


class Bag:
    """What a second reader finds in a bag."""

    def __init__(self, path):
        self.messages = defaultdict(list)
        self.log_times = defaultdict(list)
        with path.open('rb') as file:
            reader = mcap_reader.make_reader(
                file, decoder_factories=[mcap_ros2.DecoderFactory()])
            self.summary = reader.get_summary()
            self.header = reader.get_header()
            for _, channel, entry, message in reader.iter_decoded_messages():
                self.messages[channel.topic].append(message)
                self.log_times[channel.topic].append(entry.log_time)
        schemas = self.summary.schemas
        self.channels = {each.topic: each for each in self.summary.channels.values()}
        self.schemas = {
            each.topic: schemas[each.schema_id] for each in self.summary.channels.values()}

    def __getitem__(self, name):
        return self.messages[f'/phase_traj/{name}']


def written(path, frames, *, parameters=None, **options):
    parameters = parameters or Parameters(threshold=16.0)
    with BagSink(path, Mounting(parameters), source='the source', **options) as sink:
        result = replay(frames, parameters, source='the source', watchers=[sink])
    return result, Bag(path)


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return written(
        tmp_path_factory.mktemp('bag') / 'out.mcap', rolled_frames(), debug_images=True)


def ns(stamp):
    return stamp.sec * 10**9 + stamp.nanosec


def test_it_is_one_file_with_the_definitions_of_its_messages(bag):
    _, found = bag
    assert found.header.profile == 'ros2'
    assert {topic: schema.name for topic, schema in found.schemas.items()} == TYPES | DEBUG
    assert {schema.encoding for schema in found.schemas.values()} == {'ros2msg'}
    assert {channel.message_encoding for channel in found.channels.values()} == {'cdr'}
    path = found.schemas['/phase_traj/path'].data.decode()
    assert 'MSG: geometry_msgs/PoseStamped' in path and 'MSG: builtin_interfaces/Time' in path


def test_nothing_else_is_left_behind(tmp_path):
    written(tmp_path / 'out.mcap', rolled_frames())
    assert [path.name for path in tmp_path.iterdir()] == ['out.mcap']


def test_every_pair_is_in_it_once(bag):
    result, found = bag
    pairs = len(SHIFTS)
    stamps = [START_NS + (index + 1) * RATE_NS for index in range(pairs)]
    assert [message.data for message in found['movement']] == MOVEMENT
    assert [message.data for message in found['direction']] == DIRECTION
    for name in ('movement', 'shift', 'response', 'status', 'pose', 'pair', 'debug_image'):
        assert found.log_times[f'/phase_traj/{name}'] == stamps, name
    for name in ('shift', 'pose', 'pair', 'debug_image'):
        assert [ns(message.header.stamp) for message in found[name]] == stamps, name
    assert {message.header.frame_id for message in found['pose']} == {'phase_traj'}
    updates = result.updates
    assert [message.vector.x for message in found['shift']] == [
        update.shift.dx for update in updates]
    assert [message.data for message in found['response']] == [
        pytest.approx(update.shift.response, rel=1e-6) for update in updates]
    assert [message.data for message in found['status']] == [
        update.status.value for update in updates]
    assert [(message.pose.position.x, message.pose.position.y) for message in found['pose']] == [
        (update.tip.x, update.tip.y) for update in updates]


def test_what_cannot_be_measured_is_not_a_number(tmp_path):
    frames = rolled_frames([0, 0, 0])
    frames[2] = StampedFrame(frames[2].image[:80], frames[2].stamp_ns)
    _, found = written(tmp_path / 'out.mcap', frames)
    assert [math.isnan(message.vector.x) for message in found['shift']] == [False, True, True]
    assert [message.data for message in found['response']][1:] == [0, 0]
    assert [message.data for message in found['status']][1:] == ['reprimed', 'reprimed']


def test_the_chain_code_goes_out_when_the_movement_changes_else_once_a_second(tmp_path):
    _, found = written(tmp_path / 'out.mcap', rolled_frames([0] * 25 + [30, 30, 0]))
    texts = [parse_chain_code(message.data) for message in found['chain_code']]
    assert [text.frames for text in texts] == [2, 12, 22, 27, 28, 29]
    assert texts[-1].movement.runs == ((1, 25), (0, 1), (3, 1), (1, 1))


def test_all_that_is_pending_goes_out_at_the_end(tmp_path):
    result, found = written(tmp_path / 'out.mcap', rolled_frames([0] * 14))
    last_ns = START_NS + 14 * RATE_NS
    assert parse_chain_code(found['chain_code'][-1].data).frames == 15
    assert ns(found['path'][-1].header.stamp) == last_ns
    assert found['path'][-1].poses[-1].pose.position.x == result.updates[-1].tip.x == 14
    assert found.log_times['/diagnostics'] == [START_NS + 10**9, last_ns]


def test_the_path_goes_out_at_its_rate_by_the_stamps(tmp_path):
    _, found = written(
        tmp_path / 'out.mcap', rolled_frames(), parameters=Parameters(threshold=16.0))
    stamps = [ns(message.header.stamp) for message in found['path']]
    # The last one goes out at the end, whenever that is.
    assert len(stamps) == 8 and np.diff(stamps)[:-1].min() >= 0.2e9
    corners = [(each.pose.position.x, each.pose.position.y) for each in found['path'][-1].poses]
    assert corners == [(0, 0), (3, 0), (3, 4), (7, 4)]


def test_diagnostics_tell_of_the_measurement(bag):
    _, found = bag
    images, measurement = found.messages['/diagnostics'][-1].status
    assert (images.name, measurement.name) == ('/phase_traj: images', '/phase_traj: measurement')
    assert (measurement.level, measurement.message) == (0, 'measuring')
    values = {each.key: each.value for each in measurement.values}
    assert values['frames'] == '15' and 0.1 < float(values['response (median)']) <= 1
    assert images.hardware_id == 'the source'


def test_a_source_whose_name_is_not_utf8(tmp_path):
    path = tmp_path / 'out.mcap'
    with BagSink(path, Mounting(Parameters()), source='drive\udcff.mkv') as sink:
        replay(rolled_frames(), Parameters(), source='', watchers=[sink])
    assert Bag(path).messages['/diagnostics'][-1].status[0].hardware_id == 'drive\\udcff.mkv'


def test_the_debug_image_shows_the_frame(bag):
    _, found = bag
    message = found['debug_image'][3]
    assert (message.height, message.width, message.encoding, message.step) == (
        96, 160, 'bgr8', 480)
    picture = np.frombuffer(message.data, np.uint8).reshape(96, 160, 3)
    # Drawn upon, but the most of it is the frame.
    same = (picture == rolled_frames()[4].image[:, :, None]).all(axis=2)
    assert 0.4 < same.mean() < 0.95


def test_without_debug_images_there_is_no_such_topic(tmp_path):
    _, found = written(tmp_path / 'out.mcap', rolled_frames())
    assert set(found.channels) == set(TYPES)


def test_when_time_goes_back_the_bag_starts_anew(tmp_path):
    frames = rolled_frames([0, 0, 30, 30], start_ns=START_NS + 10**10) + rolled_frames([0, -30])
    _, found = written(tmp_path / 'out.mcap', frames)
    assert [message.data for message in found['movement']] == [1, 2]
    assert min(found.log_times['/phase_traj/movement']) == START_NS + RATE_NS


def test_latched_topics_are_offered_so_when_it_is_played(bag):
    _, found = bag
    offered = {
        topic: channel.metadata['offered_qos_profiles']
        for topic, channel in found.channels.items()}
    latched = {topic for topic, text in offered.items() if 'transient_local' in text}
    assert latched == {'/phase_traj/chain_code', '/phase_traj/path'}


def test_an_error_leaves_nothing_behind(tmp_path):
    with pytest.raises(SourceError, match='at least two'):
        written(tmp_path / 'out.mcap', rolled_frames([]))
    assert not list(tmp_path.iterdir())


def test_an_error_at_the_end_leaves_nothing_behind(tmp_path):
    parameters = Parameters(threshold=16.0)
    sink = BagSink(tmp_path / 'out.mcap', Mounting(parameters), source='')

    def stops_writing(*_):
        raise OSError(errno.ENOSPC, 'No space left on device')

    replay(rolled_frames(), parameters, source='', watchers=[sink])
    sink._write_whole = stops_writing
    with pytest.raises(OSError, match='No space'):
        sink.__exit__(None, None, None)
    # Before the sink itself is deleted.
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize('start_ns', [-10**10, 2**31 * 10**9])
def test_stamps_that_a_bag_cannot_hold(tmp_path, start_ns):
    with pytest.raises(OutputError, match='cannot hold the stamp'):
        written(tmp_path / 'out.mcap', rolled_frames(start_ns=start_ns))
    assert not list(tmp_path.iterdir())


def test_without_rosbags_it_says_so(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, 'rosbags.rosbag2', None)
    with pytest.raises(MissingDependencyError, match=r'0\.11 or later'):
        BagSink(tmp_path / 'out.mcap', Mounting(Parameters(threshold=16.0)), source='')


def panels_of(layout):
    """Return the panels that a layout shows."""
    if isinstance(layout, str):
        return [layout]
    return panels_of(layout['first']) + panels_of(layout['second'])


def named_in(value):
    """Return all texts that name a topic, or a field of its messages."""
    if isinstance(value, dict):
        return [text for item in value.items() for part in item for text in named_in(part)]
    if isinstance(value, list):
        return [text for part in value for text in named_in(part)]
    return [value] if isinstance(value, str) and value.startswith('/') else []


def test_everything_the_foxglove_layout_names_is_in_such_a_bag(tmp_path):
    _, found = written(
        tmp_path / 'out.mcap', rolled_frames(), debug_images=True,
        parameters=Parameters(threshold=16.0, focal_px=100.0))
    layout = json.loads(LAYOUT.read_text(encoding='utf-8'))
    assert sorted(panels_of(layout['layout'])) == sorted(layout['configById'])
    named = named_in(layout['configById'])
    assert len(named) >= 9
    for text in named:
        topic, *fields = text.split('.')
        assert found.messages[topic], text
        value = found.messages[topic][0]
        for field in fields:
            value = getattr(value, field)
    plotted = [
        path['value'] for panel in layout['configById'].values()
        for path in panel.get('paths', ())]
    assert all(text in named or re.fullmatch(r'-?\d+', text) for text in plotted)
    # What is in a pair is on topics of its own, too.
    assert {text.split('.')[0] for text in named} == {
        *TYPES, *DEBUG, '/phase_traj/heading'} - {'/phase_traj/pair'}
