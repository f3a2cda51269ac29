# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The launch file, run by ros2 launch, alone and included, where that is installed."""

from importlib.util import find_spec
import os
from pathlib import Path
import shutil
import signal
import subprocess
import sys
from threading import Timer

from live import TIMEOUT_S
import pytest


def is_installed():
    """Tell whether ros2 launch is there, and finds this package."""
    prefixes = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
    return bool(shutil.which('ros2') and find_spec('ros2launch')) and any(
        (Path(prefix) / 'share' / 'phase_traj_ros' / 'launch').is_dir() for prefix in prefixes)


pytestmark = pytest.mark.skipif(not is_installed(), reason='needs ros2 launch')

PARENT = """
from launch import LaunchDescription
from launch.actions import GroupAction, IncludeLaunchDescription
from launch_ros.actions import (
    PushRosNamespace, SetParameter, SetParametersFromFile, SetRemap)
from launch.substitutions import PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    return LaunchDescription([GroupAction([{actions}, IncludeLaunchDescription(
        PathJoinSubstitution(
            [FindPackageShare('phase_traj_ros'), 'launch', 'phase_traj.launch.py']),
        launch_arguments={arguments}.items())])])
"""
RUNS = 'parameters, with '
STARTED = []


@pytest.fixture(autouse=True)
def nothing_left():
    """End what a test that fails has left running."""
    yield
    while STARTED:
        process = STARTED.pop()
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        process.stdout.close()


class Launched:
    """What ros2 launch has printed until the nodes said what they run with, or its end."""

    def __init__(self, *arguments, nodes=1):
        self.process = subprocess.Popen(
            ['ros2', 'launch', *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, start_new_session=True)
        STARTED.append(self.process)
        self.text = ''
        # A launch that hangs is ended, and its output too.
        limit = Timer(TIMEOUT_S, os.killpg, (self.process.pid, signal.SIGKILL))
        limit.start()
        for line in self.process.stdout:
            self.text += line
            if self.text.count(RUNS) == nodes or 'Caught exception' in line:
                break
        limit.cancel()

    def ends(self):
        """Press Ctrl-C; return the exit status."""
        os.killpg(self.process.pid, signal.SIGINT)
        self.text += self.process.communicate(timeout=60)[0]
        return self.process.returncode


def launch(*arguments):
    return Launched('phase_traj_ros', 'phase_traj.launch.py', *arguments)


def provide(patch, folder, package, executable, program):
    """Provide an executable of a package that is not installed."""
    index = folder / 'share/ament_index/resource_index/packages'
    index.mkdir(parents=True)
    (index / package).touch()
    executable = folder / 'lib' / package / executable
    executable.parent.mkdir(parents=True)
    executable.write_text(program)
    executable.chmod(0o755)
    patch.setenv('AMENT_PREFIX_PATH', f'{folder}{os.pathsep}{os.environ["AMENT_PREFIX_PATH"]}')


def included(tmp_path, actions, **arguments):
    path = tmp_path / 'parent.launch.py'
    path.write_text(PARENT.format(actions=actions, arguments=arguments))
    return Launched(str(path))


@pytest.mark.parametrize(('arguments', 'message'), [
    (['rviz:=maybe'], "rviz is 'maybe': give true or false"),
    (['params_file:=nope.yaml'], "package's own: heading.yaml, paper.yaml, vehicle.yaml"),
    (['params_file:=ekf.yaml'], 'not for /phase_traj'),
    (['log_level:=debgu'], "log_level is 'debgu': give one of debug,"),
    (['image:=//bad'], "'//bad': invalid topic name"),
    (['speed:=-3'], "'speed' is -3.0: give 0 to 1000"),
    (['speed:=nan'], "'speed' is nan: give 0 to 1000"),
])
def test_what_makes_no_sense_starts_nothing(arguments, message):
    launched = launch(*arguments)
    assert message in launched.text
    assert launched.process.wait() == 1
    assert 'process started' not in launched.text


def test_a_file_that_would_end_the_node_starts_nothing(tmp_path):
    path = tmp_path / 'whole.yaml'
    path.write_text('/**:\n  ros__parameters: {threshold: 12}\n')
    launched = launch(f'params_file:={path}')
    assert "'threshold' is 12: give a double, such as 12.0" in launched.text
    assert launched.process.wait() == 1
    assert 'process started' not in launched.text


def test_the_defaults_are_shown():
    shown = subprocess.run(
        ['ros2', 'launch', 'phase_traj_ros', 'phase_traj.launch.py', '--show-args'],
        capture_output=True, text=True, check=True).stdout
    for default in ('image', 'raw', 'phase_traj', 'false', 'info'):
        assert f"(default: '{default}')" in shown


def test_without_rviz_nothing_is_left_behind():
    launched = launch('rviz:=true')
    if 'process started' in launched.text:
        assert launched.ends() == 0
        pytest.skip('rviz2 is installed')
    assert 'rviz2 is not installed' in launched.text
    assert launched.process.wait() == 1


def test_what_is_given_reaches_the_node(tmp_path):
    launched = launch(
        'image:=/cam/image_raw', 'camera_info:=/ci', 'speed:=/wheels', 'namespace:=front',
        'name:=pt', 'params_file:=heading.yaml', f'output_dir:={tmp_path}', 'reliable:=true',
        'log_level:=debug', 'respawn:=true')
    text = launched.text
    assert 'listening to /cam/image_raw, /ci, /wheels, codes from the heading' in text
    assert '[front.pt]: ' in text and 'use_speed_topic True' in text
    assert f"output_dir '{tmp_path}'" in text and 'has no effect' not in text
    assert launched.ends() == 0
    assert 'process has died' not in launched.text


def test_a_constant_speed():
    launched = launch('speed:=8.0', 'params_file:=heading.yaml')
    assert 'speed 8.0' in launched.text and 'use_speed_topic' not in launched.text
    assert launched.ends() == 0


def test_parents_set_what_is_not_given(tmp_path, live):
    launched = included(
        tmp_path, "PushRosNamespace('a'), SetParameter('threshold', 9.0),"
        " SetParameter('use_sim_time', True), SetRemap('image', '/parent')")
    assert 'listening to /parent,' in launched.text
    assert launched.text.strip().endswith(
        'parameters, with no parameter file: threshold 9.0, use_sim_time True')
    from rcl_interfaces.srv import GetParameters
    answer = live.call(
        GetParameters, '/a/phase_traj/get_parameters', GetParameters.Request(
            names=['use_sim_time']))
    assert answer.values[0].bool_value is True
    assert launched.ends() == 0


def test_a_file_that_a_parent_shares_among_its_nodes(tmp_path):
    shared = tmp_path / 'shared.yaml'
    shared.write_text('amcl:\n  ros__parameters: {alpha1: 0.2}\n')
    launched = included(
        tmp_path, f"SetParametersFromFile('{shared}')", params_file='vehicle.yaml')
    assert 'vehicle.yaml: max_gap 1.0' in launched.text and 'amcl' not in launched.text
    assert launched.ends() == 0


def test_the_managed_node_starts_itself_where_that_is_asked_for(live):
    from lifecycle_msgs.msg import State
    from lifecycle_msgs.srv import GetState

    def state():
        return live.call(
            GetState, '/phase_traj/get_state', GetState.Request()).current_state.id

    launched = launch('lifecycle:=true', 'autostart:=true', 'image_transport:=compressed')
    assert 'listening to /image/compressed,' in launched.text
    live.until(lambda: state() == State.PRIMARY_STATE_ACTIVE)
    assert launched.ends() == 0


def test_what_is_given_beats_parents(tmp_path):
    launched = included(
        tmp_path, "SetRemap('image', '/parent'), SetParameter('max_gap', 9.0)",
        image='/given', params_file='vehicle.yaml')
    assert 'listening to /given,' in launched.text
    assert 'max_gap 1.0' in launched.text
    assert launched.ends() == 0


def test_rviz_looks_at_the_topics_and_the_frame_of_the_node(tmp_path, monkeypatch):
    given = tmp_path / 'given'
    provide(monkeypatch, tmp_path / 'rviz', 'rviz2', 'rviz2',
            f'#!/bin/sh\necho "$@" > {given}\n')
    params = tmp_path / 'frame.yaml'
    params.write_text('/**:\n  ros__parameters: {frame_id: map}\n')
    launched = included(
        tmp_path, "PushRosNamespace('a')", namespace='b', rviz='true', params_file=str(params))
    assert launched.ends() == 0
    assert '-f map' in given.read_text()
    for topic in ('path', 'odom'):
        assert f'/phase_traj/{topic}:=/a/b/phase_traj/{topic}' in given.read_text()


def test_two_cameras(tmp_path):
    launched = Launched(
        'phase_traj_ros', 'two_cameras.launch.py', f'output_dir:={tmp_path}', nodes=2)
    for name in ('left', 'right'):
        [lists] = [line for line in launched.text.splitlines()
                   if f'[{name}.phase_traj]: {RUNS}' in line]
        assert f"max_gap 1.0, frame_id '{name}_drive', output_dir '{tmp_path}'" in lists
        topics = f'/{name}_camera/image_raw, /{name}_camera/camera_info'
        assert f'listening to {topics}' in launched.text
    assert launched.ends() == 0


MANAGER = """#!{python}
# Does at its start what nav2's manager does: it calls the services of the nodes that it manages.
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
import rclpy

rclpy.init()
manager = rclpy.create_node('manager', automatically_declare_parameters_from_overrides=True)
assert manager.get_name() == 'lifecycle_manager_phase_traj'
for node in manager.get_parameter('node_names').value:
    client = manager.create_client(ChangeState, node + '/change_state')
    client.wait_for_service()
    for number in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
        request = ChangeState.Request(transition=Transition(id=number))
        answer = client.call_async(request)
        rclpy.spin_until_future_complete(manager, answer)
        assert answer.result().success
print('managed', flush=True)
"""


def test_without_nav2_nothing_is_left_behind():
    launched = Launched('phase_traj_ros', 'nav2_lifecycle.launch.py')
    if 'process started' in launched.text:
        assert launched.ends() == 0
        pytest.skip('nav2_lifecycle_manager is installed')
    assert "'nav2_lifecycle_manager' not found" in launched.text
    assert launched.process.wait() == 1


@pytest.mark.parametrize(('arguments', 'name'), [
    ((), '/phase_traj'), (('name:=front', 'namespace:=cameras'), '/cameras/front')])
def test_the_manager_of_nav2_gets_the_node_unconfigured(tmp_path, monkeypatch, arguments, name):
    provide(monkeypatch, tmp_path / 'nav2', 'nav2_lifecycle_manager', 'lifecycle_manager',
            MANAGER.format(python=sys.executable))
    launched = Launched(
        'phase_traj_ros', 'nav2_lifecycle.launch.py', 'image:=/camera/image_raw', *arguments)
    assert f'unconfigured: ros2 lifecycle set {name} configure' in launched.text
    assert 'listening to /camera/image_raw,' in launched.text
    assert launched.ends() == 0
