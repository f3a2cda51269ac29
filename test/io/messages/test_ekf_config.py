# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameter file for robot_localization goes with what the node publishes."""

from pathlib import Path

import numpy as np
from phase_traj_ros.core import Corner, Odometry
from phase_traj_ros.io.messages.published import Messages
from phase_traj_ros.io.messages.topics import pair_topics, SPEED
from phase_traj_ros.parameters import NODE_NAME, Parameters
import pytest
from rosbags import typesys
import yaml

FILE = Path(__file__).resolve().parents[3] / 'config' / 'ekf.yaml'
# What robot_localization subscribes to as odom0, twist0, ...
TYPES = {
    'odom': 'nav_msgs/msg/Odometry', 'twist': 'geometry_msgs/msg/TwistWithCovarianceStamped',
    'imu': 'sensor_msgs/msg/Imu'}
# Of the 15 fields: those of the twist, in the order of its covariance.
TWIST = slice(6, 12)


@pytest.fixture(scope='module')
def values():
    return yaml.safe_load(FILE.read_text())['ekf_filter_node']['ros__parameters']


def sources(values):
    return {name for name in values if name[-1].isdigit()}


def test_each_source_says_which_of_the_fifteen_fields_it_tells(values):
    assert sources(values) == {'twist0', 'odom0', 'imu0'}
    for name in sources(values):
        fields = values[f'{name}_config']
        assert len(fields) == 15 and {type(field) for field in fields} == {bool} and any(fields)
        # Poses of odometry are sums: errors would count again and again.
        assert not any(fields[:6])


def test_its_topic_is_one_that_the_node_publishes(values):
    published = {
        f'/{NODE_NAME}/{topic.name}': topic.type
        for topic in pair_topics(Parameters(camera_height=1.65, focal_px=700.0))}
    ours = {name for name in sources(values) if values[name].startswith(f'/{NODE_NAME}')}
    assert ours == {'twist0'}
    for name in ours:
        assert published[values[name]] == TYPES[name.rstrip('0123456789')]
    assert SPEED not in pair_topics(Parameters(focal_px=700.0))


def test_the_frames_go_together(values):
    assert values['base_link_frame'] == Parameters().child_frame_id
    assert values['world_frame'] == values['odom_frame'] == Parameters().odom_frame
    # The filter places the vehicle, and a frame has one parent.
    assert values['publish_tf'] and not Parameters().publish_tf


def test_the_fields_are_those_that_are_measured(values):
    messages = Messages(typesys.get_typestore(typesys.Stores.ROS2_JAZZY).types)
    odometry = messages.odometry(
        Odometry(Corner(1.0, 2.0, 0.1, 0), 5.0, 0.1, *[0.01] * 2, ((0.01,) * 3,) * 3), 'base_link',
        messages.header(0, 'phase_traj'))
    variances = np.diag(np.reshape(odometry.twist.covariance, (6, 6)))
    assert values['twist0_config'][TWIST] == (variances < 1e3).tolist()


def test_the_filter_of_the_map_takes_the_place_and_owns_map_to_odom():
    file = FILE.with_name('ekf_map.yaml')
    [values] = (each['ros__parameters'] for each in yaml.safe_load(file.read_text()).values())
    assert values['odom0'] == f'/{NODE_NAME}/odom_map'
    # x, y and yaw: the place is absolute.
    assert [number for number, used in enumerate(values['odom0_config']) if used] == [0, 1, 5]
    assert values['twist0'] == f'/{NODE_NAME}/{SPEED.name}'
    assert not any(values['twist0_config'][:6])
    assert (values['world_frame'], values['map_frame']) == ('map', 'map')
    parameters = Parameters(camera_height=1.6)
    assert values['odom_frame'] == parameters.odom_frame
    assert values['base_link_frame'] == parameters.child_frame_id
    assert values['publish_tf'] and not parameters.publish_map_tf
