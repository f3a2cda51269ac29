# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the node publishes and what a bag written offline holds are the same."""

from collections import defaultdict

import cv2
import numpy as np
from phase_traj_ros.core import Movement, TrajectoryEstimator
from phase_traj_ros.io.messages.diagnostics import Level, Report
from phase_traj_ros.io.messages.mounting import Mounting
from phase_traj_ros.io.messages.published import Messages
from phase_traj_ros.io.replay.run import replay
from phase_traj_ros.io.results.bag import BagSink
from phase_traj_ros.io.sources.base import StampedFrame
from phase_traj_ros.parameters import Parameters
import pytest
from rosbags import rosbag2, typesys

STORE = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)

LINKS = {'speed': 5.0, 'code_step': 0.5}
PER_PAIR = ('movement', 'direction', 'shift', 'response', 'status', 'pose', 'pair')


class Publisher:
    """Keeps what is published, serialised as rosbags does it: ROS pads messages at the end."""

    def __init__(self, kind):
        package, name = kind.__module__.split('.')[0], kind.__name__
        self.type = f'{package}/msg/{name}'
        self.data = []

    def publish(self, message):
        from rclpy.serialization import serialize_message
        data = message if isinstance(message, bytes) else serialize_message(message)
        read = STORE.deserialize_cdr(data, self.type)
        self.data.append(bytes(STORE.serialize_cdr(read, self.type)))

    def get_subscription_count(self):
        return 1


class Timer:
    """Runs while there is news that has to wait."""

    runs = None

    def reset(self):
        self.runs = True

    def cancel(self):
        self.runs = False


class Node:
    """Stands in for a node: no DDS, and timers that never fire."""

    def __init__(self):
        self.publishers = {}

    def create_publisher(self, kind, topic, *args, **kwargs):
        made = self.publishers[topic.replace('~/', '')] = Publisher(kind)
        return made

    def create_timer(self, *args, **kwargs):
        return Timer()


@pytest.fixture
def frames():
    rng = np.random.default_rng(3)
    texture = cv2.GaussianBlur(rng.integers(0, 256, (96, 160), dtype=np.uint8), (0, 0), 1.5)
    places = [0, 0, 0, 30, 60, 60, 60, 20, 20]
    made = [
        StampedFrame(np.roll(texture, place, axis=1), 10**18 + index * 10**8)
        for index, place in enumerate(places)]
    # A pair that cannot be measured has a shift that is not a number.
    made.append(StampedFrame(made[-1].image, 10**18 + 10**10, 'rgb8'))
    return made


@pytest.mark.parametrize('values', [
    {}, {'hfov_deg': 30.0, 'speed': 5.0, 'path_from': 'heading'},
    {'hfov_deg': 30.0, 'camera_height': 1.65}, {'hfov_deg': 30.0, **LINKS}])
def test_the_same_messages(frames, tmp_path, values):
    from phase_traj_ros.ros.outputs.topics import Outputs
    parameters = Parameters(
        threshold=16.0, frame_id='drawn', **values)
    path = tmp_path / 'out.mcap'
    with BagSink(path, Mounting(parameters), source='', debug_images=True) as sink:
        replay(frames, parameters, source='', watchers=[sink])
    stored = defaultdict(list)
    with rosbag2.Reader(path) as reader:
        for connection, _, data in reader.messages():
            stored[connection.topic.replace('/phase_traj/', '')].append(bytes(data))

    node = Node()
    estimator = TrajectoryEstimator(parameters.settings)
    outputs = Outputs(node, estimator, parameters)
    texts, movement = [], None
    for frame in frames:
        update = estimator.update(frame.image, frame.stamp_ns, encoding=frame.encoding)
        if update is not None:
            outputs.publish(frame, update)
            if update.step.movement is not movement:
                movement = update.step.movement
                texts.append(node.publishers['chain_code'].data[-1])
    outputs.publish_state()

    more = ('heading', 'heading_stamped') if values else ()
    for topic in (*PER_PAIR, *more, 'debug_image'):
        assert node.publishers[topic].data == stored[topic], topic
        assert stored[topic]
    for topic in ('odom', 'pose_with_covariance', 'speed') if parameters.settings.metric else ():
        assert node.publishers[topic].data == stored[topic], topic
        assert stored[topic] or 'speed' not in values
    assert len(stored['movement']) == len(frames) - 1
    assert {Movement.LEFT, Movement.RIGHT} <= {data[4] for data in stored['movement']}
    # Texts at changes of the movement, and the last text and path, which come last in both.
    assert texts and all(text in stored['chain_code'] for text in texts)
    for topic in ('chain_code', 'path', *(['links'] if 'code_step' in values else [])):
        assert node.publishers[topic].data[-1] == stored[topic][-1], topic


def test_the_same_diagnostics():
    from diagnostic_msgs.msg import DiagnosticArray
    from phase_traj_ros.ros.outputs.messages import MESSAGES
    reports = {
        'images': Report(Level.STALE, 'no images', {'topic': '/image', 'images': '0'}),
        'measurement': Report(Level.OK, 'nothing to measure', {})}
    live = Publisher(DiagnosticArray)

    made = []
    for messages in (MESSAGES, Messages(STORE.types)):
        made.append(messages.diagnostics(
            reports, node='/here', hardware_id='/image', stamp=messages.time(10**18 + 5)))
    live.publish(made[0])

    assert live.data == [bytes(STORE.serialize_cdr(made[1], made[1].__msgtype__))]
    assert [status.name for status in made[1].status] == ['/here: images', '/here: measurement']
    assert [status.level for status in made[1].status] == [3, 0]


def test_the_timer_runs_while_there_is_news_that_waits(frames):
    from phase_traj_ros.ros.outputs.topics import Outputs
    timer = Timer()

    class OneTimer(Node):

        def create_timer(self, *args, **kwargs):
            return timer

    estimator = TrajectoryEstimator(Parameters().settings)
    outputs = Outputs(OneTimer(), estimator, Parameters())
    outputs.publish_state()
    assert timer.runs is False
    for frame in frames[:3]:
        update = estimator.update(frame.image, frame.stamp_ns, encoding=frame.encoding)
        if update is not None:
            outputs.publish(frame, update)
    # The path has just gone out.
    assert timer.runs is True


def test_nothing_is_made_for_nobody(frames):
    from phase_traj_ros.ros.outputs.topics import Outputs

    class Alone(Publisher):

        def get_subscription_count(self):
            return 0

    class Lonely(Node):

        def create_publisher(self, kind, topic, *args, **kwargs):
            made = self.publishers[topic.replace('~/', '')] = Alone(kind)
            return made

    node, parameters = Lonely(), Parameters()
    estimator = TrajectoryEstimator(parameters.settings)
    outputs = Outputs(node, estimator, parameters)
    for frame in frames:
        update = estimator.update(frame.image, frame.stamp_ns, encoding=frame.encoding)
        if update is not None:
            outputs.publish(frame, update)
    # What is latched is there for whoever comes later.
    assert {name for name, each in node.publishers.items() if each.data} == {
        'camera', 'chain_code', 'path'}
