# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The arguments of the launch file, checked without launch."""

from pathlib import Path

from phase_traj_ros.errors import ParameterError
from phase_traj_ros.ros.startup.launch_arguments import ARGUMENTS, node_start
import pytest


def file(tmp_path, text, node='/**'):
    path = tmp_path / 'params.yaml'
    path.write_text(f'{node}:\n  ros__parameters: {text}\n')
    return path


def test_defaults_count_as_not_given():
    defaults = {name: default for name, (default, _) in ARGUMENTS.items()}
    start = node_start(defaults)
    assert start == node_start({})
    assert (start.namespace, start.name, start.own, start.ros_arguments) == (
        '/', 'phase_traj', {}, [])


@pytest.mark.parametrize(('arguments', 'message'), [
    ({'log_level': 'debgu'}, "log_level is 'debgu': give one of debug, info"),
    ({'image': '//bad'}, "'//bad': invalid topic name"),
    ({'camera_info': 'a b'}, 'invalid topic name'),
    ({'speed': '9lives'}, "'9lives': invalid topic name"),
    ({'speed': '-3'}, "'speed' is -3.0: give 0 to 1000"),
    ({'speed': 'nan'}, "'speed' is nan: give 0 to 1000"),
    ({'name': 'a/b'}, 'invalid node name'),
    ({'namespace': '1st'}, 'invalid namespace'),
    ({'image_transport': 'theora'}, 'give one of raw, compressed'),
    ({'params_file': 'nope.yaml'}, "there is no parameter file 'nope.yaml'"),
    ({'params_file': 'ekf.yaml'}, 'has parameters for /ekf_filter_node, not for /phase_traj'),
    ({'rviz': 'maybe'}, "rviz is 'maybe': give true or false"),
    ({'autostart': 'true'}, 'give lifecycle:=true as well'),
])
def test_what_makes_no_sense_is_refused(arguments, message):
    with pytest.raises(ParameterError) as caught:
        node_start(arguments)
    assert message in str(caught.value)


@pytest.mark.parametrize(('text', 'message'), [
    ('{threshold: 12}', 'give a double, such as 12.0'),
    ('{code_source: magic}', 'give one of'),
    ('{qos_overrides: {/image: {subscription: {depth: 0}}}}', 'give an integer from 1'),
    ('{frame_id: base_link, publish_tf: true}', 'give them different names'),
])
def test_a_file_that_would_end_the_node_is_refused(tmp_path, text, message):
    with pytest.raises(ParameterError, match=message):
        node_start({'params_file': str(file(tmp_path, text))})


def test_parameters_that_only_ros_can_read_are_left_to_the_node(tmp_path):
    path = file(tmp_path, '{threshold: 1e1, unknown: 3}')
    assert node_start({'params_file': str(path)}).params_file == path


def test_the_home_folder(tmp_path, monkeypatch):
    monkeypatch.setenv('HOME', str(tmp_path))
    path = file(tmp_path, '{threshold: 9.0}')
    assert node_start({'params_file': '~/params.yaml'}).params_file == path
    assert node_start({'output_dir': '~/out'}).own == {'output_dir': str(tmp_path / 'out')}


def test_a_flag_that_is_given_replaces_that_of_a_parent():
    # As the default, false, means that nothing is given.
    for text, own in (('False', {'use_sim_time': False}), ('true', {'use_sim_time': True}),
                      ('false', {})):
        assert node_start({'use_sim_time': text}, params=[('use_sim_time', True)]).own == own


def test_the_time_of_a_parameter_file_is_that_of_the_other_nodes(tmp_path):
    path = str(file(tmp_path, '{use_sim_time: true}'))
    for given, flag in (({}, True), ({'use_sim_time': 'False'}, False)):
        assert node_start({'params_file': path, **given}).flags['use_sim_time'] is flag


@pytest.mark.parametrize(('arguments', 'around', 'topic'), [
    ({}, {}, '/image'),
    ({'namespace': 'front'}, {}, '/front/image'),
    ({'image': 'camera'}, {'namespace': '/a'}, '/a/camera'),
    ({'image': '~/camera'}, {}, '/phase_traj/camera'),
    ({'image_transport': 'compressed'}, {}, '/image/compressed'),
    ({}, {'remappings': {'image': '/x'}}, '/x'),
    ({'image': '/y'}, {'remappings': {'image': '/x'}}, '/y'),
    ({}, {'params': (('image_transport', 'compressed'),)}, '/image/compressed'),
])
def test_reliable_is_for_the_topic_that_the_node_subscribes_to(arguments, around, topic):
    start = node_start({'reliable': 'true', **arguments}, **around)
    assert start.own[f'qos_overrides.{topic}.subscription.history'] == 'keep_all'


@pytest.mark.parametrize(('base', 'namespace', 'joined'), [
    ('', '', '/'), ('a', 'b', '/a/b'), ('/a', '/b/', '/b'), ('/', 'b', '/b'), ('/a', '', '/a')])
def test_namespaces_join_as_in_launch(base, namespace, joined):
    assert node_start({'namespace': namespace}, namespace=base).namespace == joined


def test_files_of_a_parent_may_be_for_other_nodes(tmp_path):
    shared = file(tmp_path, '{frame_id: 3}', node='amcl')
    start = node_start({}, params=[shared, ('frame_id', 'map')])
    assert start.frame == 'map'
    with pytest.raises(ParameterError, match='frame_id'):
        node_start({}, params=[file(tmp_path, '{frame_id: 3}')])
    with pytest.raises(ParameterError, match='which is not a file: give its path'):
        node_start({}, params=[Path('vehicle.yaml')])


def test_what_is_given_becomes_arguments_of_ros():
    start = node_start(
        {'image': '/c', 'speed': '/odometry', 'log_level': 'debug', 'namespace': 'front'})
    assert start.ros_arguments == [
        '-r', 'image:=/c', '-r', 'speed:=/odometry', '--log-level', 'front.phase_traj:=debug']
    assert start.own == {'use_speed_topic': True}


def test_the_managed_node_may_start_itself():
    start = node_start({'lifecycle': 'true', 'autostart': 'true'})
    assert start.flags['lifecycle'] and start.own == {'autostart': True}
    assert node_start({'lifecycle': 'true'}).own == {'autostart': False}


def test_a_relative_path_is_made_absolute(tmp_path, monkeypatch):
    file(tmp_path, '{threshold: 9.0}')
    monkeypatch.chdir(tmp_path)
    assert node_start({'params_file': 'params.yaml'}).params_file == Path(
        tmp_path / 'params.yaml').resolve()
