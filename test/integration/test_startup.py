# Copyright 2026 phase_traj_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How the node starts and ends: what it was given, and signals."""

from functools import partial
from pathlib import Path
import signal
import subprocess
import sys
import time

from live import LATCHED, stop
from phase_traj_ros.ros.main import main
import pytest
from rcl_interfaces.msg import LoggerLevel
from rcl_interfaces.srv import SetLoggerLevels
from rclpy.qos import ReliabilityPolicy
from std_msgs.msg import String


@pytest.mark.parametrize(('arguments', 'message'), [
    (['--foo'], "unknown argument '--foo': see --help"),
    (['threshold:=3'], "'--ros-args -p threshold:=3'"),
    (['--ros-args', '-p', 'qos_overrides./image.subscription.reliability:=relibale'],
     "is 'relibale': give one of reliable, best_effort"),
    (['--ros-args', '-p', 'qos_overrides./image.subscription.depth:=abc'],
     "is 'abc': give an integer from 1"),
    (['--ros-args', '-p', 'qos_overrides./image.subscription.relibility:=reliable'],
     "there is no policy 'relibility': did you mean 'reliability'?"),
    (['--ros-args', '-p', 'publish_tf:=true', '-p', 'child_frame_id:=phase_traj'],
     "'frame_id' and 'child_frame_id' are both 'phase_traj'"),
    (['--ros-args', '-p', 'frame_id:=/map'], "'frame_id' is '/map'"),
    (['--ros-args', '-p', 'use_sim_time:=7'], "'use_sim_time'"),
    (['--ros-args', '-r', 'image:=/front-camera/image'],
     "'image:=/front-camera/image' is not valid: write '-r FROM:=TO'"),
    (['--ros-args', '-r', 'image=/camera'],
     "the remap rule 'image=/camera' is not valid: write '-r FROM:=TO'"),
    (['--ros-args', 'image:=/camera'],
     "'image:=/camera' is not a ROS argument: a topic is remapped by '-r FROM:=TO'"),
    (['--ros-args', '-p', 'threshold=9.0'], "write '-p NAME:=VALUE'"),
    (['--ros-args', '--log-level', 'debgu'], 'give debug, info, warn, error or fatal'),
    (['--ros-args', '--params-file', 'nope.yaml'],
     "there is no parameter file 'nope.yaml': give a path, or one of the package's own: heading"),
])
def test_what_makes_no_sense_is_refused_in_a_line(capfd, arguments, message):
    assert main(arguments) == 2
    check_line(capfd.readouterr().err, message)


def test_a_log_folder_that_cannot_be_made_is_said_in_a_line(capfd, monkeypatch):
    monkeypatch.setenv('ROS_LOG_DIR', '/proc/nowhere')
    assert main([]) == 2
    check_line(capfd.readouterr().err, 'set ROS_LOG_DIR or HOME to a folder that can be written')


def test_a_process_ends_with_the_status_and_the_line(live):
    assert live.start(lossless=False, arguments=['--foo']).wait() == 2
    check_line(live.logs(), "unknown argument '--foo': see --help")


def test_a_process_that_cannot_write_its_log_says_so_in_a_line(live, monkeypatch):
    monkeypatch.setenv('ROS_LOG_DIR', '/proc')
    assert live.start(lossless=False).wait() == 2
    check_line(live.logs(), 'set ROS_LOG_DIR or HOME to a folder that can be written')


def check_line(log, message):
    said = [line for line in log.splitlines() if '[rcl]' not in line]
    assert len(said) == 1
    assert message in said[0]


def test_help_is_printed(live):
    process = live.start(lossless=False, arguments=['--help'])
    assert process.wait() == 0
    assert 'usage: phase_traj_node' in live.logs()


def test_an_override_of_another_topic_has_no_effect_and_that_is_said(live):
    live.start('-p', 'qos_overrides./imag.subscription.depth:=9', lossless=False)
    live.until_said("did you mean 'qos_overrides./image.subscription.depth'")


def test_an_override_of_one_topic_leaves_the_others(live):
    live.start(
        '-p', 'qos_overrides./phase_traj/debug_image.publisher.reliability:=reliable',
        lossless=False)
    for reliability, endpoints, topic in (
            (ReliabilityPolicy.RELIABLE,
             live.node.get_publishers_info_by_topic, '/phase_traj/debug_image'),
            (ReliabilityPolicy.BEST_EFFORT,
             live.node.get_subscriptions_info_by_topic, '/image')):
        live.until(partial(endpoints, topic))
        [found] = endpoints(topic)
        assert found.qos_profile.reliability is reliability


def params(path, name, text='{threshold: 9.0}'):
    path.write_text(f'{name}:\n  ros__parameters: {text}\n')
    return ['--params-file', str(path)]


def test_one_underscore_is_refused_in_a_line(live, tmp_path):
    path = tmp_path / 'a.yaml'
    path.write_text('/**:\n  ros_parameters: {threshold: 9.0}\n')
    assert live.start('--params-file', str(path)).wait() == 2
    assert "has 'ros_parameters' in '/**': write 'ros__parameters', with two" in live.logs()


@pytest.mark.parametrize(('name', 'namespace'), [
    ('phase_traj', '/front'), ('/front/phase_traj', '/'), ('other', '/')])
def test_a_parameter_file_for_other_nodes_only_is_said(live, tmp_path, name, namespace):
    live.start(*params(tmp_path / 'a.yaml', name), '-r', f'__ns:={namespace}', lossless=False)
    full_name = f'{namespace.rstrip("/")}/phase_traj'
    live.until_said(
        f'not for {full_name}: put them under', 'parameters, with no parameter file: all at')


def test_a_file_shared_with_other_nodes_comes_before_the_own(live, tmp_path):
    shared = params(tmp_path / 'shared.yaml', 'amcl', '{alpha1: 0.2}')
    own = params(tmp_path / 'own.yaml', 'phase_traj')
    live.start(*shared, *own)
    live.until_said(f'parameters, with {own[1]}: threshold 9.0')
    assert 'amcl' not in live.logs()


def test_a_file_of_the_package_is_found_by_its_name(live):
    live.start('--params-file', 'vehicle.yaml')
    live.until_said('config/vehicle.yaml: max_gap 1.0')


def test_what_every_node_has_is_listed_too(live):
    live.start('-p', 'use_sim_time:=true', lossless=True)
    live.until_said(
        'no parameter file: use_sim_time True,'
        " qos_overrides./image.subscription.history 'keep_all'")


def test_what_has_no_effect_is_said_with_what_to_write(live):
    live.start(
        '-p', 'treshold:=9.0', '-p', 'qos_overrides./image.subscription.durability:=volatile',
        lossless=False)
    live.until_said(
        'durability is fixed for this topic',
        "there is no parameter 'treshold': did you mean 'threshold'?")


def test_the_node_says_what_it_runs_with(live, tmp_path):
    file = params(tmp_path / 'a.yaml', '/**/phase_traj')
    live.start(*file, '-p', 'max_gap:=1.0', '-r', '__ns:=/front')
    live.until_said(f'parameters, with {file[1]}: threshold 9.0, max_gap 1.0')


@pytest.fixture(scope='module')
def started(shared_live):
    """Start a node for tests that only ask it; return what they ask it with."""
    shared_live.start('-p', 'speed:=8.0', '-p', 'hfov_deg:=80.0')
    return shared_live


def test_the_chain_code_is_there_before_the_first_image(started):
    texts = started.listen(String, 'phase_traj/chain_code', LATCHED)
    started.until(lambda: texts)
    assert texts[0].data.startswith('frames 0;')


def test_the_level_of_the_log_changes_while_the_node_runs(started):
    request = SetLoggerLevels.Request(levels=[LoggerLevel(name='phase_traj', level=10)])
    answer = started.call(SetLoggerLevels, '/phase_traj/set_logger_levels', request)
    assert [each.successful for each in answer.results] == [True]
    started.until_said('microseconds per image')


@pytest.mark.parametrize('autostart', ['true', 'false'])
def test_any_number_of_signals_ends_it_in_order(live, autostart):
    process = live.start('-p', f'autostart:={autostart}')
    # Its own words, not the graph, which may still know a node that was killed before.
    live.until_said('[phase_traj]', process=process)
    while process.poll() is None:
        process.send_signal(signal.SIGINT)
        time.sleep(0.01)
    assert process.returncode == 0, live.logs()
    assert 'Traceback' not in live.logs()


def catches(pid, number):
    """Tell whether a process has a handler of its own for a signal."""
    status = Path(f'/proc/{pid}/status').read_text()
    [mask] = [line.split()[1] for line in status.splitlines() if line.startswith('SigCgt')]
    return int(mask, 16) >> (number - 1) & 1


def test_a_signal_while_modules_are_imported_ends_it_in_order():
    process = subprocess.Popen(
        [sys.executable, '-m', 'phase_traj_ros.ros.main'], stderr=subprocess.PIPE, text=True)
    # Python itself has a handler for SIGINT, but none for SIGTERM.
    while not catches(process.pid, signal.SIGTERM):
        assert process.poll() is None
    assert stop(process, signal.SIGINT) == 0
    assert process.stderr.read() == ''
    process.stderr.close()
